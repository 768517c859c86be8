"""The drift monitor of a station: what the fixed chessboard says of mount and light.

At each board the arm looks at the same chessboard from the same poses, as it did when the board
was taught. How the camera has moved on its mount since then, and how the light has changed,
follow from these pictures alone; what is drift and what is the arm's repeatability, from the
calibration's own covariance (mount) and from the readings' own scatter (light).

Two levels of alarm. A `warning`: the drift is more than chance. `recalibrate`: besides, what it
would leave at the targets, if nothing took it out, exceeds a share of the tolerance, or a board was
refused because its pictures contradict the calibration.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from aoicell.calibration.cell_model import CellModel
from aoicell.errors import InputError
from aoicell.first_look import Reference, camera_equations
from aoicell.line.control_chart import Chart, innovations, studentised
from aoicell.line.drift_effect import left_at_targets
from aoicell.line.reference_light import light_change
from aoicell.observation import Observation
from aoicell.online import Online, references_seen
from aoicell.transforms import Array

Level = Literal["warning", "recalibrate"]
What = Literal["mount", "light"]
MOUNT = slice(0, 6)  # of a motion: the camera's twist; the last number is the focal length's


@dataclass(frozen=True)
class MonitorConfig:
    """When to raise an alarm.

    Each of the two charts, mount and light, warns falsely once in `run_length` boards on the
    average; a new reading counts `weight` in its moving average. `recalibrate` follows when more
    than `share` of what is accepted is used up: `tolerance_mm` at the targets of a board that came
    turned by up to `turn_deg`, a change of the light by `light_tolerance` (0.3: by 30 %).
    """

    run_length: float = 1000.0
    weight: float = 0.2
    share: float = 0.25  # a gauge is to be four times as good as what it judges
    tolerance_mm: float = 0.5
    turn_deg: float = 15.0
    light_tolerance: float = 0.3


@dataclass(frozen=True)
class Reading:
    """One look at the reference, against the look when the board was taught: the camera's twist in
    its own axes (m, rad) and the relative change of its focal length, (7,); the light, as the
    natural logarithm of its ratio, None where no picture tells it.
    """

    motion: tuple[float, ...]
    light: float | None


@dataclass(frozen=True)
class Status:
    """What the charts say after a board.

    `mount` and `light` are their statistics, above 1 in units of the limit where the drift is more
    than chance. `motion` (7,) and `light_change` (relative) are the drift as it is estimated, with
    standard deviations of the motion; `left_mm` is what it would leave at the targets.
    """

    mount: float
    light: float
    motion: tuple[float, ...]
    motion_std: tuple[float, ...]
    light_change: float
    left_mm: float


@dataclass(frozen=True)
class Alarm:
    """What has drifted, how far, and what to do about it."""

    level: Level
    what: What
    hint: str


class Monitor:
    """Collects the readings since the board was taught, and says what they amount to.

    Everything follows from the readings in their order: a monitor that is given the same ones
    again is in the same state.
    """

    def __init__(self, online: Online, config: MonitorConfig = MonitorConfig()) -> None:
        """Raises InputError for a method that knows no covariance or has seen no reference."""
        if online.calibration.model is None or not online.template.references:
            raise InputError(
                f"method '{online.method.name}': it has no fixed reference, or no covariance to "
                "tell drift from chance by; monitor a line by 'aoicell'"
            )
        self._online, self._config = online, config
        self._model: CellModel = online.calibration.model
        self._readings = [Reading((0.0,) * 7, 0.0)]  # the reference as it was taught
        self._first = 1
        self._alarms: set[tuple[Level, What]] = set()
        references = references_seen(online.template.references, online)
        # of one look; the equations have the scatter of two, as taught and now
        self._covariance = _motion(self._model, references)[1] / 2
        self._mount = Chart(6, config.weight, config.run_length)
        self._light = Chart(1, config.weight, config.run_length)

    def read(self, pictures: Sequence[Observation]) -> Reading:
        """The reference in new pictures from its poses. Raises Refused where it is not clear."""
        online = self._online
        references = references_seen(pictures, online)
        motion, _ = _motion(self._model, references)
        changes = [
            self._light_change(taught, now, reference)
            for taught, now, reference in zip(
                online.template.references, pictures, references, strict=False
            )
            if now.image.size
        ]
        known = [change for change in changes if change is not None]
        light = float(np.mean(known)) if known else None
        return Reading(tuple(motion.tolist()), light)

    def _light_change(
        self, taught: Observation, now: Observation, reference: Reference
    ) -> float | None:
        board = self._online.nominal.tabletarget
        corners = self._online.detector.chessboard(taught, board, "reference as taught")
        after = corners + reference.moved_px
        return light_change(board, (taught.grey, corners), (now.grey, after))

    def set_up(self, readings: Sequence[Reading]) -> None:
        """Take readings for those of an unchanged cell: the mean is the better known for them."""
        self._readings += readings
        self._first = len(self._readings)

    def add(self, reading: Reading) -> tuple[Alarm, ...]:
        """Take in the reading of a board; the alarms that it raises, each once."""
        self._readings.append(reading)
        status, config = self.status, self._config
        left, light = status.left_mm / config.tolerance_mm, abs(status.light_change)
        return (
            *self._judge("mount", status.mount, left, status),
            *self._judge("light", status.light, light / config.light_tolerance, status),
        )

    def _judge(self, what: What, statistic: float, used: float, status: Status) -> list[Alarm]:
        raised = self._new("warning", what, status) if statistic > 1 else []
        if ("warning", what) in self._alarms and used > self._config.share:
            raised += self._new("recalibrate", what, status)
        return raised

    def recall(self, reading: Reading | None, cause: str) -> None:
        """Take in a board of before, with the cause of its refusal ("" for none)."""
        if reading is not None:
            self.add(reading)
        if cause == "contradicted":
            self.contradicted()

    def contradicted(self) -> tuple[Alarm, ...]:
        """A correction was refused because its pictures contradict the calibration: with a drift
        that is known to be there, the drift is the reason.
        """
        if ("warning", "mount") not in self._alarms:
            return ()
        return tuple(self._new("recalibrate", "mount", self.status))

    def _new(self, level: Level, what: What, status: Status) -> list[Alarm]:
        if (level, what) in self._alarms:
            return []
        self._alarms.add((level, what))
        return [Alarm(level, what, self._hint(level, what, status))]

    @property
    def status(self) -> Status:
        """What all readings so far amount to."""
        motions = np.array([reading.motion for reading in self._readings])
        light = np.array([r.light for r in self._readings if r.light is not None])
        mount = self._mount.statistics(
            innovations(motions[:, MOUNT], self._covariance[MOUNT, MOUNT])
        )
        grey = self._light.statistics(studentised(light))
        drift, share = self._drifted(motions, self._first)
        lit = [reading.light is not None for reading in self._readings[: self._first]]
        brighter, _ = self._drifted(light[:, None], sum(lit))
        turn = float(np.radians(self._config.turn_deg))
        std = np.sqrt(share * np.diag(self._covariance))
        return Status(
            mount=_last(mount) / self._mount.limit,
            light=_last(grey) / self._light.limit,
            motion=tuple(drift.tolist()),
            motion_std=tuple(std.tolist()),
            light_change=float(np.expm1(brighter[0])),
            left_mm=1e3 * float(left_at_targets(self._online, drift, (-turn, 0.0, turn)).max()),
        )

    def _drifted(self, values: Array, first: int) -> tuple[Array, float]:
        """The moving average of readings (N, p) less the mean of the `first`, which are those of
        the set-up, and its variance in that of one reading.
        """
        mean = values[:first].mean(axis=0)
        average, weight = mean, self._config.weight
        for value in values[first:]:
            average = weight * value + (1 - weight) * average
        fading = (1 - weight) ** (len(values) - first)
        variance = weight / (2 - weight) * (1 - fading**2) + (1 - fading) ** 2 / first
        return average - mean, variance

    def _hint(self, level: Level, what: What, status: Status) -> str:
        if what == "light":
            change = status.light_change
            word = "brighter" if change > 0 else "darker"
            advice = {
                "warning": "look after the lamps",
                "recalibrate": "clean or set the lamps, then teach again",
            }[level]
            return f"light: {abs(change):.1%} {word} than when the board was taught; {advice}"
        mm, deg = 1e3 * np.array(status.motion[:3]), np.degrees(status.motion[3:6])
        advice = {
            "warning": "check the camera's holder",
            "recalibrate": "tighten the camera's holder, then calibrate and teach again",
        }[level]
        return (
            f"camera mount: moved by ({_listed(mm)}) mm and turned by ({_listed(deg, 3)}) deg in "
            f"its own axes since the board was taught, which would leave {status.left_mm:.2f} of "
            f"{self._config.tolerance_mm:.2f} mm at the targets; {advice}"
        )


def _motion(model: CellModel, references: Sequence[Reference]) -> tuple[Array, Array]:
    """The camera's motion (7,) by generalised least squares, and its covariance (7, 7)."""
    A, z, noise = camera_equations(model, references)
    whole = A.T @ np.linalg.solve(noise, np.column_stack([A, z]))
    covariance = np.linalg.inv(whole[:, :7])
    return covariance @ whole[:, 7], (covariance + covariance.T) / 2


def _last(values: Array) -> float:
    return float(values[-1]) if len(values) else 0.0


def _listed(values: Array, digits: int = 2) -> str:
    return ", ".join(f"{round(float(value), digits) + 0.0:.{digits}f}" for value in values)
