"""The error sources of a cell: every one a field with a unit, a distribution and a legal range.

Zero switches a source off. What each profile sets, and why, stands in `profiles`.
"""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, field_validator


def _knob(high: float, what: str, distribution: str = "normal, sigma", low: float = 0.0) -> Any:
    return Field(
        default=0.0,
        ge=low,
        le=high,
        allow_inf_nan=False,
        description=what,
        json_schema_extra={"distribution": distribution},
    )


def _fixed(high: float, what: str, low: float = 0.0) -> Any:
    return _knob(high, what, "fixed", low)


class Tolerances(BaseModel):
    """How far a real cell lies from its design. Negative, NaN or absurd values are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    # arm
    joint_zero_deg: float = _knob(5, "zero offset of each joint")
    link_mm: float = _knob(20, "each coordinate of each joint origin")
    axis_deg: float = _knob(5, "alignment of each joint axis, about each coordinate")
    repeatability_mm: float = _knob(
        5, "RP of ISO 9283: 3.6 sigma of one axis at the flange", "normal, new at each arrival"
    )
    backlash_deg: float = _fixed(1, "play of each joint: it stops half of it short of its target")
    compliance_deg_per_kNm: float = _fixed(2, "deflection of each joint under its gravity torque")
    settle_mm: float = _fixed(20, "how far the flange still is from its rest on arrival")
    settle_ms: float = _fixed(5000, "time constant with which it comes to rest")
    wait_ms: float = _fixed(60_000, "pause between arrival and picture")
    lag_ms: float = _fixed(1000, "how much older the picture is than the pose reported with it")
    # camera holder
    mount_mm: float = _knob(50, "each coordinate of the camera on the flange")
    mount_deg: float = _knob(20, "rotation of the camera on the flange, about each axis")
    mount_bias_x_mm: float = _fixed(50, "error of the holder along the flange's x", low=-50)
    mount_bias_z_mm: float = _fixed(50, "error of the holder along the flange's z", low=-50)
    # both cameras: geometry
    focal_percent: float = _knob(10, "focal length")
    principal_px: float = _knob(200, "each coordinate of the principal point")
    skew_px: float = _knob(50, "skew of the pixel raster, K[0, 1]")
    k1: float = _fixed(0.5, "mean radial distortion, quadratic", low=-0.5)
    k1_sigma: float = _knob(0.1, "its spread")
    k2_sigma: float = _knob(0.5, "radial distortion, quartic")
    tangential_sigma: float = _knob(0.01, "each tangential coefficient, p1 and p2")
    focal_drift_ppm: float = _knob(5000, "warm-up of the hand camera's focal length over a shift")
    # both cameras: light on the sensor
    psf_px: float = _fixed(10, "point spread of the lens in focus, sigma")
    aperture_mm: float = _fixed(50, "entrance pupil; the blur grows with the distance from focus")
    focus_mm: float = _fixed(10_000, "distance that is in focus; 0: everything is")
    exposure_ms: float = _fixed(1000, "exposure time: blurs what still moves")
    exposure_percent: float = _knob(50, "brightness of a camera")
    vignetting_percent: float = _fixed(90, "loss of light in the corners")
    electrons_per_grey: float = _fixed(
        1000, "gain: the variance of the shot noise is grey value over gain; 0: none"
    )
    noise_grey: float = _knob(50, "read noise, grey values", "normal, new in each pixel")
    adc_bits: float = _fixed(12, "resolution of the converter, 8 to 12 bits; 0: exact")
    # light
    light_percent: float = _knob(50, "level of the lamps")
    light_deg: float = _knob(30, "direction of each lamp")
    light_kelvin: float = _knob(3000, "colour temperature, about 5500 K")
    gradient_percent: float = _fixed(90, "fall of the light over the picture, direction drawn")
    flicker_percent: float = _knob(50, "level of the light", "normal, new in each picture")
    shadows: float = _fixed(1, "1: arm and camera cast shadows")
    # prints and boards
    print_um: float = _knob(1000, "width and height of each print")
    bow_mm: float = _knob(10, "height of a chessboard's centre over its edges")
    twist_mm: float = _knob(10, "height of two opposite corners over the others")
    marker_mm: float = _knob(10, "each marker against the board's drawing, x and y")
    marker_deg: float = _knob(10, "turn of each marker on the board")
    marker_lift_mm: float = _knob(5, "height of each marker: the board's own bow")
    board_thickness_mm: float = _knob(5, "height of the board's surface over the table")
    board_tilt_deg: float = _knob(10, "tilt of the board on the table, about x and y")
    component_height_mm: float = _knob(5, "height of each component")
    component_colour_percent: float = _knob(50, "brightness of each component")
    dust_percent: float = _fixed(20, "share of each print that specks of dust cover")
    occlusion_percent: float = _fixed(50, "share of each marker's edge that is covered")
    glare: float = _fixed(1, "specular reflection of solder mask and prints")
    # what people place by hand
    placement_mm: float = _knob(50, "chessboard 2 and server board on the table, x and y")
    placement_deg: float = _knob(20, "their turn about the normal of the table")
    tripod_mm: float = _knob(200, "each coordinate of the tripod")
    tripod_deg: float = _knob(20, "rotation of the tripod, about each axis")
    bracket_mm: float = _knob(20, "each coordinate of chessboard 1 on its bracket")
    bracket_deg: float = _knob(10, "rotation of chessboard 1, about each axis")

    @field_validator("adc_bits")
    @classmethod
    def _converter_exists(cls, bits: float) -> float:
        if bits != 0 and not (bits >= 8 and bits.is_integer()):
            raise ValueError("a converter has 8 to 12 whole bits; 0 is exact")
        return bits
