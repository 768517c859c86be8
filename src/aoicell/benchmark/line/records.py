"""What is kept of a board of the line."""

from dataclasses import dataclass

from aoicell.benchmark.records import InspectionRecord
from aoicell.line.monitor import Alarm, Reading, Status


@dataclass(frozen=True)
class BoardRecord:
    """One board: what the station made of it, and what is true of it.

    `slot` counts boards and set-ups, `set_up` is the slot of the set-up that the board was
    inspected by (-1: the first). `truth` is the verdict that would be right for what the views
    show ("either" at the limit of a tolerance, "" where none was given). `planted` counts
    defects, `unseen` those that no view shows, `escapes` and `false_calls` parts. Residuals are
    means over component points, one by view; bounds (95 %, 99.9 %) are the largest over the views.
    `drifted` is the true drift since that set-up: camera (mm, deg), light (relative).
    `set_up_next`: the cell is calibrated and taught again before the next board.
    """

    number: int
    slot: int
    set_up: int
    verdict: str
    reason: str
    cause: str
    truth: str
    planted: int
    unseen: int
    escapes: int
    false_calls: int
    residuals_mm: dict[str, float]
    predicted_mm: float | None
    bound_mm: float | None
    reading: Reading | None
    status: Status
    alarms: list[Alarm]
    drifted_mm: float
    drifted_deg: float
    drifted_light: float
    arm_seconds: float
    compute_seconds: float
    inspection: InspectionRecord | None = None
    set_up_next: bool = False

    @property
    def residual_mm(self) -> float | None:
        """Mean over the views; None when none was visited."""
        values = self.residuals_mm.values()
        return sum(values) / len(values) if values else None

    @property
    def is_wrong(self) -> bool:
        """Whether the verdict is not the right one; none at all is never wrong."""
        return (self.verdict, self.truth) in (("pass", "fail"), ("fail", "pass"))


@dataclass(frozen=True)
class SetUpRecord:
    """One calibration and teaching: its slot, the board that came after it, the readings of the
    reference that ended it, and what it took on the cell's clock and on the computer (s).
    """

    slot: int
    before_board: int
    readings: list[Reading]
    arm_seconds: float
    compute_seconds: float
