"""Tolerance profiles: the value of every knob, with the source of each.

`ideal`: everything exact. `typical`: a good industrial cell. `paper`: what the paper states or
implies of its own cell, and stated assumptions; not tuned to its residual.
"""

from collections.abc import Mapping
from types import MappingProxyType

from aoicell.sim.tolerances import Tolerances

Sourced = Mapping[str, tuple[float, str]]

_PAPER_TABLE_3 = "the paper, Table 3: the holder against its design"
_BY_HAND = "assumed: put down by hand against a mark"
_BY_EYE = "assumed: set up by eye"
_LENS = "usual data sheet of a 12 mm C-mount lens"
_SENSOR = "EMVA 1288 sheets of 2 MP industrial CMOS sensors, rounded"
_LAMP = "assumed: LED area light without closed-loop control"

# Common to every real cell; the profiles below add the rest.
_REAL_CAMERA: Sourced = {
    "focal_percent": (1.0, _LENS),
    "principal_px": (10.0, "assumed: 45 um between sensor and mount"),
    "skew_px": (0.05, "assumed: a CMOS raster is square to 0.002 %"),
    "k1": (-0.08, _LENS),
    "k1_sigma": (0.02, _LENS),
    "k2_sigma": (0.02, _LENS),
    "tangential_sigma": (2e-4, "assumed: lens elements centred to some 10 um"),
    "focal_drift_ppm": (100.0, "assumed: 5 K of warm-up, 20 ppm/K of lens and barrel"),
    "psf_px": (0.6, _LENS + ": about 50 % contrast at half the Nyquist frequency"),
    "aperture_mm": (1.5, "f/8 at 12 mm"),
    "focus_mm": (700.0, "set between P_check (0.5 m) and the overview (1.15 m)"),
    "exposure_ms": (5.0, "assumed: LED light, still object"),
    "exposure_percent": (3.0, "assumed: set once by hand"),
    "vignetting_percent": (15.0, _LENS),
    "electrons_per_grey": (40.0, _SENSOR + ": 10 ke- full well over 255"),
    "noise_grey": (0.3, _SENSOR + ": about 10 e-"),
    "adc_bits": (10.0, _SENSOR),
    "light_percent": (5.0, _LAMP),
    "light_deg": (3.0, _BY_EYE),
    "light_kelvin": (300.0, "LED binning, ANSI C78.377"),
    "gradient_percent": (10.0, _LAMP),
    "flicker_percent": (0.5, _LAMP),
    "component_height_mm": (0.1, "assumed: solder and part tolerances"),
    "component_colour_percent": (5.0, "assumed: parts of several makers"),
    "glare": (0.1, "assumed: diffuse light, matt laminate"),
    "settle_mm": (0.5, "assumed: following error of a stiff arm after a fast move"),
    "settle_ms": (40.0, "assumed: 5 to 10 Hz structure, well damped"),
    "wait_ms": (300.0, "chosen: seven time constants"),
    "lag_ms": (5.0, "assumed: a hardware trigger through a field bus"),
    "placement_mm": (5.0, _BY_HAND),
    "placement_deg": (1.0, _BY_HAND),
    "tripod_mm": (30.0, _BY_EYE),
    "tripod_deg": (1.0, _BY_EYE),
}

TYPICAL_SOURCES: Sourced = {
    **_REAL_CAMERA,
    "joint_zero_deg": (0.02, "assumed: an arm calibrated by its maker"),
    "link_mm": (0.2, "assumed: likewise"),
    "axis_deg": (0.02, "assumed: likewise"),
    "repeatability_mm": (0.06, "assumed RP of the RA620-1621; its maker's model states none"),
    "backlash_deg": (0.003, "assumed: precision gears"),
    "compliance_deg_per_kNm": (0.003, "assumed: what is left after the controller's own model"),
    "mount_mm": (1.0, "assumed: a milled holder, mounted by hand"),
    "mount_deg": (0.5, "assumed: likewise"),
    "print_um": (10.0, "assumed: a photographic print on glass or aluminium"),
    "bow_mm": (0.02, "assumed: a board of 5 mm aluminium composite"),
    "twist_mm": (0.02, "assumed: likewise"),
    "marker_mm": (0.2, "assumed: placed with a jig"),
    "marker_deg": (0.2, "assumed: likewise"),
    "marker_lift_mm": (0.05, "IPC-A-610: bow of at most 0.75 %, over 30 mm, supported"),
    "board_thickness_mm": (0.05, "usual: 2 mm laminate, 10 %, quarter of the range"),
    "board_tilt_deg": (0.02, "standoffs equal to 0.1 mm over 300 mm"),
    "dust_percent": (0.1, "assumed: a clean cell"),
    "bracket_mm": (0.5, "assumed: a bolted bracket"),
    "bracket_deg": (0.3, "assumed: likewise"),
}

PAPER_SOURCES: Sourced = {
    **_REAL_CAMERA,
    "joint_zero_deg": (0.1, "assumed: an arm that nobody calibrated"),
    "link_mm": (0.5, "assumed: likewise"),
    "axis_deg": (0.02, "as typical"),
    "repeatability_mm": (0.1, "assumed: a worn or loaded arm"),
    "backlash_deg": (0.003, "as typical"),
    "compliance_deg_per_kNm": (0.01, "assumed: no compensation of gravity"),
    "mount_mm": (0.5, "assumed: a 3D-printed part, beside its two known errors"),
    "mount_deg": (0.7, "assumed: the tilt that goes with 9 mm over a printed holder's length"),
    "mount_bias_x_mm": (9.0, _PAPER_TABLE_3),
    "mount_bias_z_mm": (2.0, _PAPER_TABLE_3),
    "print_um": (100.0, "assumed: an office laser printer, 0.1 % over some 100 mm"),
    "bow_mm": (0.3, "assumed: paper glued on a plate"),
    "twist_mm": (0.2, "assumed: likewise"),
    "marker_mm": (0.5, "assumed: stuck on by hand"),
    "marker_deg": (0.5, "assumed: likewise"),
    "marker_lift_mm": (0.2, "assumed: paper on a populated board"),
    "board_thickness_mm": (0.2, "assumed: a chassis, not a bare board"),
    "board_tilt_deg": (0.05, "assumed: likewise"),
    "dust_percent": (0.5, "assumed: a workshop"),
    "bracket_mm": (0.5, "assumed: 3D-printed, as the holder"),
    "bracket_deg": (0.3, "assumed: likewise"),
}


def _values(sources: Sourced) -> Tolerances:
    return Tolerances(**{name: value for name, (value, _) in sources.items()})


SOURCES: Mapping[str, Sourced] = MappingProxyType(
    {"ideal": {}, "typical": TYPICAL_SOURCES, "paper": PAPER_SOURCES}
)
PROFILES: Mapping[str, Tolerances] = MappingProxyType(
    {name: _values(sources) for name, sources in SOURCES.items()}
)
IDEAL, TYPICAL, PAPER = (PROFILES[name] for name in ("ideal", "typical", "paper"))
