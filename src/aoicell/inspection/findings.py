"""What an inspection says: of each component, of what does not belong there, of the board."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from aoicell.inspection.registration import FineRegistration
from aoicell.transforms import Array

State = Literal["present", "absent", "shifted", "rotated", "wrong_part", "no_verdict"]
Verdict = Literal["pass", "fail", "no_verdict"]
Box = tuple[int, int, int, int]  # left, top, right, bottom (px), the last two exclusive


@dataclass(frozen=True)
class Finding:
    """One component in one view.

    `shift` (x, y) in the board's frame (m) and `rotation` (rad) are measured against the
    reference; zero where nothing was measured. `confidence`, 0 to 1, is how probable the state is
    against its alternatives by the noise model. `area_px` is where the component is shown, in the
    reference's pixels, and `visible` the share of it that is to be seen there. `covariance` (3, 3)
    of shift and rotation (m, m, rad) where they were measured, and `fit` how probable it is that
    the part looks as it should.
    """

    component: str
    state: State
    shift: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    confidence: float = 0.0
    view: str = ""
    area_px: Box = (0, 0, 0, 0)
    visible: float = 0.0
    reason: str = ""
    covariance: Array | None = field(default=None, compare=False, repr=False)
    fit: float = 1.0

    @property
    def is_defect(self) -> bool:
        """Whether something is wrong with it."""
        return self.state not in ("present", "no_verdict")


@dataclass(frozen=True)
class ForeignObject:
    """Something that lies where the reference shows bare board or a part that is in order.

    `place` (x, y) on the board (m), `size` the longer side of its box (m).
    """

    place: tuple[float, float]
    size: float
    confidence: float
    view: str
    area_px: Box


@dataclass(frozen=True)
class ViewInspection:
    """One picture against its reference; a finding for each component that the view may show."""

    view: str
    registration: FineRegistration
    findings: Mapping[str, Finding]
    foreign: tuple[ForeignObject, ...] = ()


@dataclass(frozen=True)
class BoardInspection:
    """All views together: `fail` when anything is wrong, `no_verdict` when nothing is but
    something that the views should show could not be judged.

    `components` has the finding of the view that shows a component best; those that no view shows
    are named in `hidden`, and not judged.
    """

    verdict: Verdict
    components: Mapping[str, Finding]
    foreign: tuple[ForeignObject, ...]
    registrations: Mapping[str, FineRegistration]
    hidden: tuple[str, ...] = ()
