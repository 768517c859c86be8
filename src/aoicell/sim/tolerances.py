"""Tolerance profiles: how far a real cell lies from its design.

Every field is one error source with its unit in its name; sigma of a normal distribution
unless its description says otherwise. Zero switches a source off.
"""

from types import MappingProxyType
from typing import Any

from pydantic import BaseModel, ConfigDict, Field


def _knob(high: float, source: str, low: float = 0.0) -> Any:
    return Field(default=0.0, ge=low, le=high, allow_inf_nan=False, description=source)


class Tolerances(BaseModel):
    """The error sources of a cell. Legal ranges are checked: negative, NaN or absurd is refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    # arm
    joint_zero_deg: float = _knob(5.0, "zero offset of each joint")
    link_mm: float = _knob(20.0, "each coordinate of each joint origin")
    axis_deg: float = _knob(5.0, "alignment of each joint axis, about each coordinate")
    repeatability_mm: float = _knob(5.0, "RP of ISO 9283; per axis RP/3.6, new at each arrival")
    # camera holder
    mount_mm: float = _knob(50.0, "each coordinate of the camera on the flange")
    mount_deg: float = _knob(20.0, "rotation of the camera on the flange, about each axis")
    mount_bias_x_mm: float = _knob(50.0, "fixed error of the holder along x", low=-50.0)
    mount_bias_z_mm: float = _knob(50.0, "fixed error of the holder along z", low=-50.0)
    # both cameras
    focal_percent: float = _knob(10.0, "focal length")
    principal_px: float = _knob(200.0, "each coordinate of the principal point")
    k1: float = _knob(0.5, "mean radial distortion, quadratic", low=-0.5)
    k1_sigma: float = _knob(0.1, "spread of the radial distortion")
    noise_grey: float = _knob(50.0, "noise of a pixel in grey values, new in each picture")
    # what people place by hand
    placement_mm: float = _knob(50.0, "table board and server board on the table, x and y")
    placement_deg: float = _knob(20.0, "their turn about the normal of the table")
    tripod_mm: float = _knob(200.0, "each coordinate of the tripod")
    tripod_deg: float = _knob(20.0, "rotation of the tripod, about each axis")
    bracket_mm: float = _knob(20.0, "each coordinate of chessboard 1 on its bracket")
    bracket_deg: float = _knob(10.0, "rotation of chessboard 1, about each axis")
    marker_mm: float = _knob(10.0, "each marker against the board's drawing, x and y")
    marker_deg: float = _knob(10.0, "turn of each marker on the board")


IDEAL = Tolerances()

# Not tuned to the paper's residual: what it states or implies, and stated assumptions.
PAPER = Tolerances(
    joint_zero_deg=0.1,  # assumed: an arm that nobody calibrated
    link_mm=0.5,  # assumed, likewise
    repeatability_mm=0.1,  # assumed: a worn or loaded arm (0.06 mm is assumed of a new one)
    mount_mm=0.5,  # assumed: a 3D-printed part
    mount_deg=0.7,  # assumed: the tilt that goes with 9 mm over a printed holder's length
    mount_bias_x_mm=9.0,  # the paper, Table 3
    mount_bias_z_mm=2.0,  # the paper, Table 3
    focal_percent=1.0,  # usual lens data sheet
    principal_px=10.0,  # usual sensor-to-mount tolerance, 45 um
    k1=-0.08,  # a 12 mm C-mount lens
    k1_sigma=0.02,
    noise_grey=1.5,  # an industrial CMOS sensor, low gain
    placement_mm=5.0,  # put down by hand against a mark
    placement_deg=1.0,
    tripod_mm=30.0,  # set up by eye
    tripod_deg=1.0,
    bracket_mm=0.5,  # 3D-printed, as the holder
    bracket_deg=0.3,
    marker_mm=0.5,  # stuck on by hand
    marker_deg=0.5,
)

# A good industrial cell.
TYPICAL = Tolerances(
    joint_zero_deg=0.02,  # assumed: an arm calibrated by its maker
    link_mm=0.2,
    axis_deg=0.02,
    repeatability_mm=0.06,  # assumed for the RA620-1621 (ISO 9283 RP); its maker states none
    mount_mm=1.0,  # a milled holder, mounted by hand
    mount_deg=0.5,
    focal_percent=1.0,  # usual lens data sheet
    principal_px=10.0,
    k1=-0.08,
    k1_sigma=0.02,
    noise_grey=1.5,
    placement_mm=5.0,
    placement_deg=1.0,
    tripod_mm=30.0,
    tripod_deg=1.0,
    bracket_mm=0.5,
    bracket_deg=0.3,
    marker_mm=0.2,  # placed with a jig
    marker_deg=0.2,
)

PROFILES = MappingProxyType({"ideal": IDEAL, "typical": TYPICAL, "paper": PAPER})
