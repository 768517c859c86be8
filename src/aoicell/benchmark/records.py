"""What a run leaves behind: plain frozen records, ready for a table or a file."""

from dataclasses import dataclass
from typing import Literal

Outcome = Literal["corrected", "refused", "failed"]
Matrix = list[list[float]]


@dataclass(frozen=True)
class MarkerRecord:
    """One marker in one view: cross centres (4, 2) in px, detected, in both pictures.

    `detected_px` and `true_px` are mean distances of the four crosses between the standard
    and the new image; `image_mm` the detected one times the local scale.
    """

    id: str
    detected_px: float | None
    true_px: float
    image_mm: float | None
    standard_uv_px: Matrix | None
    new_uv_px: Matrix | None


@dataclass(frozen=True)
class ViewRecord:
    """One inspection view after a correction, scored from truth at `points` component points.

    `vector_mm` is the signed mean of the residual vectors in the camera's axes; `predicted_mm`
    what the software itself says that the residual stays below (95 %), `bound_mm` the same with
    99.9 %; null when it does not say.
    """

    id: str
    points: int
    residual_mm: float
    vector_mm: list[float]
    predicted_mm: float | None
    lateral_mm: float
    depth_mm: float
    deg: float
    markers: list[MarkerRecord]
    T_base_camera_taught: Matrix
    T_base_camera_new: Matrix
    bound_mm: float | None = None


@dataclass(frozen=True)
class PartRecord:
    """A component that was wrong, or was called so, and what the inspection said of it.

    `planted` is the kind of defect, "" where the part is good; `tolerated` that its tolerance
    class allows the defect, so the part is good after all. `state` is the verdict, "" of a foreign
    object that was not noticed; `called` whether it was reported. `shift_error_mm` is the distance
    of the measured from the true shift, where a shift was planted. The box is in the picture.
    """

    component: str
    kind: str
    planted: str
    tolerated: bool
    width_mm: float
    depth_mm: float
    shift_mm: float
    rotation_deg: float
    state: str
    called: bool
    confidence: float | None
    shift_error_mm: float | None
    view: str
    box_px: list[float] | None
    reason: str = ""


@dataclass(frozen=True)
class RegistrationRecord:
    """One view: how the inspection itself rates its registration, and its true error (px)."""

    view: str
    state: str
    own_px: float | None
    error_px: float | None


@dataclass(frozen=True)
class InspectionRecord:
    """A board's inspection: its planted defects, what was called, and how many parts were good.

    `parts` has every planted defect and every false call; `no_verdict` counts parts, `unseen`
    those that lie under others, so that no view can show them.
    """

    verdict: str
    good_components: int
    no_verdict: int
    unseen: int
    parts: list[PartRecord]
    registrations: list[RegistrationRecord]


@dataclass(frozen=True)
class TrialRecord:
    """One method on one displacement, in one world of one case of the scenario.

    `number` counts the trials of the whole run: it repeats this one alone. `cause` is that of a
    refusal (see `aoicell.errors.Why`), `injected` what was made to go wrong.
    """

    case: int
    number: int
    world: int
    trial: int
    method: str
    outcome: Outcome
    reason: str
    displacement_mm: float
    turn_deg: float
    measured_shift_mm: float | None
    correction_seconds: float | None
    T_base_board_taught: Matrix
    T_base_board_now: Matrix
    views: list[ViewRecord]
    cause: str = ""
    injected: str = ""
    inspection: InspectionRecord | None = None


@dataclass(frozen=True)
class HandEyeRecord:
    """Hand-eye of one method: against the connector's design, and against the truth."""

    method: str
    T_flange_camera: Matrix
    design_mm: list[float]
    design_deg: list[float]
    true_offset_mm: list[float]
    error_mm: float
    error_deg: float
    scatter_mm: float
    intrinsics_rms_px: float
    views: int


@dataclass(frozen=True)
class WorldRecord:
    """What was calibrated once in a world of a case, and what its arm can do at best."""

    case: int
    world: int
    arm_floor_mm: float
    hand_eyes: list[HandEyeRecord]
    unused_pictures: list[str]
