"""Error sources: the knobs of a cell, grouped as an engineer would name them."""

from types import MappingProxyType

from aoicell.sim.tolerances import Tolerances

SOURCES = MappingProxyType(
    {
        "arm geometry": ("joint_zero_deg", "link_mm", "axis_deg"),
        "arm repeatability": (
            "repeatability_mm", "backlash_deg", "settle_mm", "settle_ms", "wait_ms", "lag_ms",
        ),
        "gravity": ("compliance_deg_per_kNm",),
        "camera holder": ("mount_mm", "mount_deg", "mount_bias_x_mm", "mount_bias_z_mm"),
        "lens and sensor geometry": (
            "focal_percent", "principal_px", "skew_px", "k1", "k1_sigma", "k2_sigma",
            "tangential_sigma",
        ),
        "focal drift": ("focal_drift_ppm",),
        "image and dust": (
            "psf_px", "aperture_mm", "focus_mm", "exposure_ms", "exposure_percent",
            "vignetting_percent", "electrons_per_grey", "noise_grey", "adc_bits", "dust_percent",
        ),
        "light and surfaces": (
            "light_percent", "light_deg", "light_kelvin", "gradient_percent", "flicker_percent",
            "shadows", "occlusion_percent", "glare", "component_height_mm",
            "component_colour_percent",
        ),
        "printed targets": ("print_um", "bow_mm", "twist_mm"),
        "markers on the board": ("marker_mm", "marker_deg", "marker_lift_mm"),
        "placement": (
            "board_thickness_mm", "board_tilt_deg", "placement_mm", "placement_deg", "tripod_mm",
            "tripod_deg", "bracket_mm", "bracket_deg",
        ),
    }
)  # fmt: skip


def knobs_of(source: str) -> tuple[str, ...]:
    """The knobs of a source; a knob's own name stands for itself."""
    return SOURCES.get(source, (source,))


def is_on(profile: Tolerances, source: str) -> bool:
    """Whether the profile has anything of a source (or knob)."""
    return any(getattr(profile, knob) for knob in knobs_of(source))


def only(profile: Tolerances, source: str) -> Tolerances:
    """The profile with one source (or knob) alone; everything else ideal."""
    return Tolerances(**{knob: getattr(profile, knob) for knob in knobs_of(source)})


def all_but(profile: Tolerances, source: str) -> Tolerances:
    """The profile without one source (or knob)."""
    return profile.model_copy(update=dict.fromkeys(knobs_of(source), 0.0))
