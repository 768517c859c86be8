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
