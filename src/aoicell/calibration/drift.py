"""Is an old calibration still good? A drift check from a handful of new views.

The old intrinsics, mount and print sizes, with their covariance, are held against what the new
views show. Where the target lies now is estimated, unless it is said to be fixed. One view of a
target that may have moved tells nothing: it has six numbers for twelve unknowns.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np
import pinocchio as pin

from aoicell.calibration.drift_effect import Effect, hidden_error, working_error
from aoicell.calibration.drift_groups import (
    ARM,
    CAMERA,
    EVERYTHING,
    TARGET,
    alarms_among,
    best_of,
    change_groups,
    rivals_of,
    sentence_of,
)
from aoicell.calibration.drift_reference import (
    Reference,
    covariance_in,
    nearer_reading,
    placed_by,
    under_reference,
)
from aoicell.calibration.drift_statistics import (
    ChangeTest,
    DriftModel,
    Whitened,
    columns,
    tail,
    whiten,
)
from aoicell.calibration.half_turns import half_turn_of, settle_half_turns
from aoicell.calibration.measurement import linearise
from aoicell.calibration.motion import examine_motion
from aoicell.calibration.observability import natural_steps
from aoicell.calibration.parameters import Estimate, Layout, Model, layout_of, retract
from aoicell.calibration.problem import Problem, moves
from aoicell.calibration.starts import SightPoses, sight_poses
from aoicell.errors import Implausible
from aoicell.transforms import Array

Verdict = Literal["ok", "drifted", "cannot tell"]
_ROUNDS = 4  # of linearising where the best explanation puts things


@dataclass(frozen=True)
class DriftLimits:
    """`significance`: how often nothing has changed and the check still says so.

    `hidden_share`: how much of its distance the target may be placed off by a change that the
    views would not show (two standard deviations), before the check says that it cannot tell.
    """

    significance: float = 0.01
    hidden_share: float = 2e-3


@dataclass(frozen=True)
class DriftReport:
    """What a drift check found.

    `tests`: a chi-square for each group of parameters and for all at once; `changed`: the group
    that explains the views best, where something has changed, and `instead` the others that
    explain them about as well. `moved` is how far each target lies from where it was, as a
    twist (6,) in its own axes with standard deviations (6,). `effect` is the error at the
    targets if the old calibration is used anyway, `hidden_mm` what a knock of the camera could
    add without being seen (one standard deviation). `noise_ratio`: pixel noise over the old one.
    """

    verdict: Verdict
    reasons: tuple[str, ...]
    tests: tuple[ChangeTest, ...]
    changed: ChangeTest | None
    instead: tuple[str, ...]
    moved: Mapping[str, tuple[Array, Array]]
    effect: Effect | None
    hidden_mm: float
    noise_ratio: float
    views: int
    unused: Mapping[str, str]


def check_drift(
    problem: Problem, reference: Reference, fixed: bool = False,
    limits: DriftLimits = DriftLimits(),
) -> DriftReport:  # fmt: skip
    """Holds new views of one eye against an old calibration; `fixed`: no target has moved.

    The eye's own intrinsics are not used. Raises InputError where the problem is of another kind.
    """
    posed = sight_poses(under_reference(problem, reference))
    readings = settle_half_turns(posed.problem, posed.poses)
    problem, poses = readings.problem, readings.poses
    enough = 1 if fixed else 2
    if len(problem.views) < enough:
        return _nothing(len(problem.views), enough, posed.rejected)
    views = _Views.of(problem, poses, reference, fixed)
    return views.report(limits, posed.rejected)


def _nothing(views: int, enough: int, unused: Mapping[str, str]) -> DriftReport:
    seen = "no view shows" if views == 0 else "one view shows"
    reason = f"{seen} a target, at least {enough} are needed"
    if enough == 2:
        reason += (
            ": a view of a target that may have moved has six numbers for twelve unknowns; "
            "photograph it from three or more poses, tilted about two axes by 15 deg or more"
        )
    nan = np.nan
    return DriftReport(
        "cannot tell", (reason,), (), None, (), MappingProxyType({}), None, nan, nan, views, unused
    )


@dataclass(frozen=True)
class _Views:
    """New views beside an old calibration, linearised where the best explanation puts things."""

    problem: Problem
    poses: SightPoses
    reference: Reference
    layout: Layout
    step: Array
    groups: Mapping[str, tuple[Array, Array]]
    start: Estimate
    offset: Array
    nuisance: Array
    covariance: Array

    @classmethod
    def of(cls, problem: Problem, poses: SightPoses, reference: Reference, fixed: bool) -> "_Views":
        layout = layout_of(problem, Model(reference.lens, "per_view"))
        (eye,) = problem.eyes
        places, offset = {}, np.zeros(layout.size)
        nuisance: list[int] = []
        covariance = covariance_in(layout, reference)
        for fixture in problem.fixtures:
            block = layout.blocks["fixture", fixture.name]
            now = placed_by(problem, poses, reference, fixture.name)
            then = reference.T_mount_fixture.get(fixture.name)
            if then is not None and fixture.half_turns:
                then, turn = nearer_reading(then, now, half_turn_of(fixture))
                carried = np.eye(layout.size)
                carried[block, block] = turn.toActionMatrixInverse()
                covariance = carried @ covariance @ carried.T
            if then is not None:
                offset[block] = pin.log6(then.actInv(now)).vector
            if then is None or not fixed or not moves(eye, fixture):
                nuisance += range(block.start, block.stop)
            places[fixture.name] = now
        cameras = {} if reference.camera is None else {eye.name: reference.camera}
        scales = {f.name: reference.scales.get(f.name, 1.0) for f in problem.fixtures}
        start = Estimate(
            {eye.name: reference.T_mount_eye}, places, cameras, scales,
            np.zeros((len(problem.views), 6)), forms=reference.forms,
        )  # fmt: skip
        return cls(
            problem, poses, reference, layout, natural_steps(layout),
            change_groups(layout, reference), start, offset, columns(layout.size, nuisance),
            covariance,
        )  # fmt: skip

    @property
    def noise_freedoms(self) -> float:
        """From how many numbers the spread of the views was learnt."""
        return max(6.0 * self.reference.views - len(self.reference.names), 6.0)

    def whitened(self, sigma: float, estimate: Estimate) -> Whitened | None:
        """The views at an estimate; None where it has points behind the camera."""
        lin = linearise(self.problem, self.layout, estimate)
        if not lin.in_front or not np.isfinite(lin.residuals).all():
            return None
        return whiten(lin, sigma, self.reference.noise.deviation, self.step)

    def report(self, limits: DriftLimits, unused: Mapping[str, str]) -> DriftReport:
        """Raises Implausible where the old calibration has the targets behind the camera."""
        sigma, ratio = self._sigma()
        if self.whitened(sigma, self.start) is None:
            raise Implausible(
                "drift check: with the old calibration the target would lie behind the camera; "
                "check the mount, the direction of the poses and that they belong to the pictures"
            )
        estimate, offset, chosen = self.start, self.offset, None
        for _ in range(_ROUNDS):
            seen = self.whitened(sigma, estimate)
            if seen is None:
                break
            model = DriftModel.of(
                seen, offset, self.covariance, self.nuisance, self.step, self.noise_freedoms
            )
            last, tests = seen, self._tests(model)
            chosen = best_of(tests, self.noise_freedoms, limits.significance)
            directions = self.groups[chosen.name][0] if chosen else np.zeros((len(offset), 0))
            values = chosen.values if chosen else np.zeros(0)
            wanted = directions @ values
            wanted = wanted + self.nuisance @ model.nuisance_values(directions, values)
            held = ~self.nuisance.any(axis=1)
            if chosen is None:
                wanted[held] = offset[held]
            step, offset = wanted - offset, wanted
            if (np.abs(step) < 1e-3 * self.step).all():
                break
            estimate = retract(self.layout, estimate, step, estimate.deviations)
        tests = (*tests, self._robot(last))
        hidden = hidden_error(self.problem, self.poses, _named(tests, CAMERA))
        effect = None
        if chosen is not None and chosen.name != TARGET:
            effect = working_error(
                self.problem, self.layout, self.start, estimate, chosen, self.groups[chosen.name][0]
            )
        verdict, reasons = self._judge(tests, chosen, hidden, limits)
        close = rivals_of(tests, chosen)
        return DriftReport(
            verdict, reasons, tests, chosen if verdict == "drifted" else None, close,
            self._moved(model, chosen), effect, hidden * 1e3, ratio,
            len(self.problem.views), unused,
        )  # fmt: skip

    def _sigma(self) -> tuple[float, float]:
        """Pixel noise to reckon with, not below the old one, and its ratio to it.

        With each flange where its own view has it: what is left is the points', not the arm's.
        """
        old = self.reference.noise.sigma
        deviations = self.start.deviations.copy()
        (eye,) = self.problem.eyes
        for (v, s), T in reversed(list(self.poses.items())):
            fixture = self.problem.fixture(self.problem.views[v].sights[s].fixture)
            if moves(eye, fixture):
                A, Y = self.problem.views[v].T_base_flange, self.start.T_mount_fixture[fixture.name]
                X = self.reference.T_mount_eye
                flange = Y * (X * T).inverse() if eye.mount == "flange" else X * T * Y.inverse()
                deviations[v] = pin.log6(A.actInv(flange)).vector
        seen = self.whitened(old, replace(self.start, deviations=deviations))
        if seen is None or seen.pixel_freedoms < 1:
            return old, 1.0
        ratio = float(np.sqrt(seen.pixels_left / seen.pixel_freedoms))
        return old * max(ratio, 1.0), ratio

    def _tests(self, model: DriftModel) -> tuple[ChangeTest, ...]:
        single = tuple(model.test(name, D, scale) for name, (D, scale) in self.groups.items())
        fixed = np.flatnonzero(~self.nuisance.any(axis=1))
        D = columns(self.layout.size, fixed.tolist())
        return (*single, model.test(EVERYTHING, D, self.step[fixed]))

    def _robot(self, seen: Whitened) -> ChangeTest:
        """Whether the flanges disagree among themselves by more than they did."""
        left, freedoms = seen.left - seen.pixels_left, seen.freedoms - seen.pixel_freedoms
        left, nothing = max(left, 0.0), np.zeros(0)
        p = tail(left, freedoms, self.noise_freedoms)
        return ChangeTest(ARM, left, freedoms, p, nothing, np.zeros((0, 0)))

    def _moved(
        self, model: DriftModel, chosen: ChangeTest | None
    ) -> Mapping[str, tuple[Array, Array]]:
        """How far each target lies from where it was, whatever else has changed."""
        moved = {}
        D = self.groups[chosen.name][0] if chosen else np.zeros((self.layout.size, 0))
        for fixture in self.problem.fixtures:
            if fixture.name not in self.reference.T_mount_fixture:
                continue
            block = self.layout.blocks["fixture", fixture.name]
            mine = columns(self.layout.size, range(block.start, block.stop))
            others = self.nuisance[:, ~self.nuisance[block].any(axis=0)]
            beside = replace(model, nuisance=np.hstack([others, D]))
            test = beside.test(fixture.name, mine, self.step[block])
            moved[fixture.name] = (test.values, np.sqrt(np.diag(test.covariance)))
        return MappingProxyType(moved)

    def _judge(
        self, tests: tuple[ChangeTest, ...], chosen: ChangeTest | None, hidden: float,
        limits: DriftLimits,
    ) -> tuple[Verdict, tuple[str, ...]]:  # fmt: skip
        alarms = alarms_among(tests, limits.significance)
        if alarms:
            return "drifted", tuple(self._causes(alarms, chosen))
        centre = np.array([T.act(np.zeros(3)) for T in self.poses.values()])
        distance = float(np.median(np.linalg.norm(centre, axis=1)))
        if not 2 * hidden <= limits.hidden_share * distance:
            return "cannot tell", (self._missing(hidden, distance, limits),)
        return "ok", ()

    def _causes(self, alarms: list[ChangeTest], chosen: ChangeTest | None) -> list[str]:
        causes = [] if chosen is None else [sentence_of(chosen)]
        if any(test.name == ARM for test in alarms):
            causes.append(
                "the views disagree among themselves by more than the arm's repeatability: a loose "
                "robot base, a lost joint zero, or pictures and poses that do not belong together"
            )
        return causes

    def _missing(self, hidden: float, distance: float, limits: DriftLimits) -> str:
        hides = f"{2e3 * hidden:.1f} mm at the target" if np.isfinite(hidden) else "any distance"
        sentence = (
            f"a knock of the camera by {hides} would not show in these {len(self.problem.views)} "
            f"views (wanted: {limits.hidden_share * distance * 1e3:.1f} mm); "
        )
        (motion, *_) = [*examine_motion(self.problem, self.poses), None]
        if motion is None or motion.turn_deg[0] < 4:
            return sentence + "photograph the target tilted about two axes by 15 deg or more"
        if motion.turn_deg[1] < 4:
            axis = motion.axes[0] * np.sign(motion.axes[0][np.abs(motion.axes[0]).argmax()])
            x, y, z = axis + 0.0
            return sentence + (
                f"all views turn about ({x:.2f}, {y:.2f}, {z:.2f}) of the flange: add one that is "
                "tilted about an axis across it by 15 deg or more"
            )
        return sentence + "photograph the target from more poses, tilted about two axes"


def _named(tests: tuple[ChangeTest, ...], name: str) -> ChangeTest:
    return next(t for t in tests if t.name == name)
