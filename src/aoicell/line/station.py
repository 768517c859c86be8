"""One board at the station: find it, correct, go and look, inspect, decide.

Knows the `Cell` protocol only. Where anything declines to answer, the board goes to an operator:
no verdict is better than a wrong one.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from numpy.typing import ArrayLike

from aoicell.correction import Correction
from aoicell.errors import Refused, Unreachable
from aoicell.inspection.findings import BoardInspection, Verdict
from aoicell.inspection.references import Reference
from aoicell.line.monitor import Alarm, Monitor, Reading
from aoicell.observation import CameraName, Cell, Image, Observation, RobotState, capture_at
from aoicell.online import Looked, Online, look, relocate, visit

Inspect = Callable[[Mapping[str, Image], Mapping[str, Reference]], BoardInspection]


@dataclass(frozen=True)
class Inspected:
    """What the station makes of a board.

    `reason` and `cause` say why there is no verdict. `reading` is that of the drift monitor, None
    where the reference was not clear, and `alarms` what it raised. `compute_seconds` is measured;
    moves and pictures are not in it.
    """

    verdict: Verdict
    reason: str
    cause: str
    correction: Correction | None
    images: Mapping[str, Observation]
    inspection: BoardInspection | None
    reading: Reading | None
    alarms: tuple[Alarm, ...]
    compute_seconds: float


class Station:
    """A calibrated cell at a line, taught one kind of board.

    `references` are the standards of the views, `inspect` compares pictures with them; without it
    boards are found and photographed, and nothing is said of them.
    """

    def __init__(
        self,
        cell: Cell,
        online: Online,
        monitor: Monitor,
        references: Mapping[str, Reference] = MappingProxyType({}),
        inspect: Inspect | None = None,
    ) -> None:
        self._cell, self._online, self.monitor = _Stopwatch(cell), online, monitor
        self._references, self._inspect = references, inspect

    def get_ready(self, looks: int) -> tuple[Reading, ...]:
        """Inspect the taught board's own pictures, and look at the reference so often, coming as
        one comes to it with a board there: the cell is taken for unchanged while that lasts.

        Raises Refused where the standard images do not pass.
        """
        self._inspect_standards()
        template, readings = self._online.template, []
        for _ in range(looks):
            self._cell.move(template.look.state.q)
            pictures = capture_at(self._cell, [taught.state.q for taught in template.references])
            readings.append(self.monitor.read(pictures))
        self.monitor.set_up(readings)
        self._go_home()
        return tuple(readings)

    def _inspect_standards(self) -> None:
        if self._inspect is None:
            return
        standards = {v.id: v.standard.grey for v in self._online.template.views}
        inspection = self._inspect(standards, self._references)
        if inspection.verdict == "fail":
            wrong = [id for id, finding in inspection.components.items() if finding.is_defect]
            raise Refused(
                "line: the taught board does not pass its own inspection "
                f"({', '.join(wrong) or 'a foreign object'}); teach a good board"
            )

    def process(self) -> Inspected:
        """Inspect the board that lies there. Never raises Refused: that is a verdict here."""
        start, waited = time.perf_counter(), self._cell.seconds
        reading: Reading | None = None
        alarms: tuple[Alarm, ...] = ()
        correction: Correction | None = None
        images: Mapping[str, Observation] = {}
        inspection: BoardInspection | None = None
        verdict: Verdict = "no_verdict"
        reason, cause = "", ""
        try:
            looked = look(self._cell, self._online)
            reading, alarms = self._monitored(looked)
            correction = relocate(looked, self._online)
            visited = visit(self._cell, correction, self._online)
            correction, images = visited.correction, visited.images
            if self._inspect is None:
                reason = "nothing was inspected"
            else:
                greys = {id: observation.grey for id, observation in images.items()}
                inspection = self._inspect(greys, self._references)
                verdict, reason = _decided(inspection, correction)
        except Refused as refusal:
            reason, cause = str(refusal), refusal.cause
            if cause == "contradicted":
                alarms += self.monitor.contradicted()
        self._go_home()
        seconds = time.perf_counter() - start - (self._cell.seconds - waited)
        return Inspected(
            verdict, reason, cause, correction, images, inspection, reading, alarms, seconds
        )

    def _monitored(self, looked: Looked) -> tuple[Reading | None, tuple[Alarm, ...]]:
        try:
            reading = self.monitor.read(looked.references)
        except Refused:
            return None, ()  # the correction will say so, if that matters to it
        return reading, self.monitor.add(reading)

    def _go_home(self) -> None:
        """The arm out of the way of the next board; by the look-out pose where it has to."""
        home = self._online.nominal.q_home
        try:
            self._cell.move(home)
        except Unreachable:
            self._cell.move(self._online.template.look.state.q)
            self._cell.move(home)


def _decided(inspection: BoardInspection, correction: Correction) -> tuple[Verdict, str]:
    """The board's verdict, which is no `pass` when a view could not be taken."""
    missing = "; ".join(view.reason for view in correction.unreached)
    if inspection.verdict == "pass" and missing:
        return "no_verdict", missing
    if inspection.verdict != "no_verdict":
        return inspection.verdict, ""
    unclear = {id: f for id, f in inspection.components.items() if f.state == "no_verdict"}
    first = next((f"{id}: {f.reason}" for id, f in unclear.items()), "no component was judged")
    return "no_verdict", f"{len(unclear)} components without a verdict, {first}"


class _Stopwatch:
    """A cell that counts the seconds that its moves and pictures take."""

    def __init__(self, cell: Cell) -> None:
        self._cell, self.seconds = cell, 0.0

    def move(self, q: ArrayLike) -> None:
        start = time.perf_counter()
        try:
            self._cell.move(q)
        finally:
            self.seconds += time.perf_counter() - start

    def state(self) -> RobotState:
        return self._cell.state()

    def capture(self, camera: CameraName = "hand") -> Observation:
        start = time.perf_counter()
        try:
            return self._cell.capture(camera)
        finally:
            self.seconds += time.perf_counter() - start
