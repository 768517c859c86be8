"""A drawn cell as plain numbers by name, and which of them belongs to which knob."""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from fnmatch import fnmatchcase

import numpy as np
from scipy.spatial.transform import Rotation

from aoicell.camera import Camera
from aoicell.nominal import Nominal
from aoicell.sim.as_built import AsBuilt, Geometry
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import PAPER
from aoicell.sim.tolerances import Tolerances
from aoicell.transforms import Array

KNOBS = list(Tolerances.model_fields)
# The paper's cell, and a value for what it leaves at zero, too.
EVERYTHING = PAPER.model_copy(update={"shadows": 1.0, "occlusion_percent": 2.0})

OWNED = {  # the parts that each knob moves, as patterns of the names in `parts`
    "joint_zero_deg": "joint_offsets",
    "link_mm": "link_?.[xyz]",
    "axis_deg": "link_?.R",
    "repeatability_mm": "arrival.repeatability_sigma",
    "backlash_deg": "arrival.backlash",
    "compliance_deg_per_kNm": "arrival.compliance",
    "settle_mm": "arrival.settle",
    "settle_ms": "arrival.settle_time",
    "wait_ms": "arrival.wait",
    "lag_ms": "arrival.lag",
    "mount_mm": "camera.[xyz]",
    "mount_deg": "camera.R",
    "mount_bias_x_mm": "camera.x",
    "mount_bias_z_mm": "camera.z",
    "focal_percent": "lens_*.f",
    "principal_px": "lens_*.c",
    "skew_px": "lens_*.skew",
    "k1": "lens_*.k1",
    "k1_sigma": "lens_*.k1",
    "k2_sigma": "lens_*.k2",
    "tangential_sigma": "lens_*.p",
    "focal_drift_ppm": "sensor_hand.focal_drift",
    "psf_px": "sensor_*.psf_px",
    "aperture_mm": "sensor_*.aperture",
    "focus_mm": "sensor_hand.focus",
    "exposure_ms": "sensor_*.exposure",
    "exposure_percent": "sensor_*.brightness",
    "vignetting_percent": "sensor_*.vignetting",
    "electrons_per_grey": "sensor_*.gain",
    "noise_grey": "sensor_*.noise_grey",
    "adc_bits": "sensor_*.adc_bits",
    "light_percent": "light.level",
    "light_deg": "light.turns",
    "light_kelvin": "light.colour",
    "gradient_percent": "light.gradient",
    "flicker_percent": "light.flicker",
    "shadows": "light.shadows",
    "print_um": "print_*",
    "bow_mm": "bow_*",
    "twist_mm": "twist_*",
    "marker_mm": "M?.[xy]",
    "marker_deg": "M?.R",
    "marker_lift_mm": "M?.z",
    "board_thickness_mm": "board.z",
    "board_tilt_deg": "board.tilt",
    "component_height_mm": "surfaces.heights",
    "component_colour_percent": "surfaces.brightness",
    "dust_percent": "surfaces.dust",
    "occlusion_percent": "surfaces.occlusion",
    "glare": "surfaces.glare",
    "placement_mm": "board.[xy] tabletarget.[xy]",
    "placement_deg": "board.turn tabletarget.R",
    "tripod_mm": "tripod.[xyz]",
    "tripod_deg": "tripod.R",
    "bracket_mm": "armtarget.[xyz]",
    "bracket_deg": "armtarget.R",
}
SIGNED = ["mount_bias_x_mm", "mount_bias_z_mm", "k1"]
UNITS = {
    "_mm": 1e-3, "_um": 1e-6, "_ms": 1e-3, "_percent": 1e-2, "_ppm": 1e-6,
    "_deg": np.radians(1), "_deg_per_kNm": np.radians(1) / 1e3,
}  # fmt: skip


# ---- a drawing as plain numbers ----------------------------------------------------------------


def parts(as_built: AsBuilt) -> dict[str, Array]:
    """All that is drawn, in SI units; the parts of one name belong to the same knobs."""
    found = geometry_parts(as_built.geometry)
    groups = {"arrival": as_built.arrival, "light": as_built.light, "surfaces": as_built.surfaces}
    groups |= {f"sensor_{name}": sensor for name, sensor in as_built.sensors.items()}
    for group, holder in groups.items():
        for field in fields(holder):
            value = getattr(holder, field.name)
            numbers = list(value.values()) if isinstance(value, Mapping) else value
            found[f"{group}.{field.name}"] = np.asarray(numbers, dtype=float)
    del found["surfaces.seed"]  # is no draw
    return found


def geometry_parts(geometry: Geometry) -> dict[str, Array]:
    poses = {
        "camera": geometry.T_flange_camera,
        "armtarget": geometry.T_flange_armtarget,
        "tabletarget": geometry.T_base_tabletarget,
        "tripod": geometry.T_base_tripod,
        "board": geometry.T_base_board,
        **{f"link_{i}": T for i, T in enumerate(geometry.joint_corrections)},
        **geometry.Ts_board_marker,
    }
    found = {"joint_offsets": geometry.joint_offsets}
    for name, T in poses.items():
        found |= {f"{name}.{axis}": T.translation[i] for i, axis in enumerate("xyz")}
        found[f"{name}.R"] = T.rotation
    # placing by hand turns the board, its stand tilts it: one rotation taken apart
    found["board.tilt"], found["board.turn"] = tilt_and_turn(found.pop("board.R"))
    for name, camera in geometry.cameras.items():
        found |= {f"lens_{name}.{quantity}": v for quantity, v in lens_parts(camera).items()}
    found |= {f"print_{name}": np.array(scale) for name, scale in geometry.print_scales.items()}
    for name, (bow, twist) in geometry.bows.items():
        found |= {f"bow_{name}": np.array(bow), f"twist_{name}": np.array(twist)}
    return found


def tilt_and_turn(R: Array) -> tuple[Array, Array]:
    """Tilt (2,) about x and y, for small angles, and the turn about z before it (rad).

    The turn is rounded: a tilt reaches its last bits.
    """
    *_, z, w = Rotation.from_matrix(R).as_quat()
    return np.array([R[2, 1], -R[2, 0]]), np.round(2 * np.arctan2(z, w), 12)


def lens_parts(camera: Camera) -> dict[str, Array]:
    K, (k1, k2, p1, p2, k3) = camera.K, camera.distortion
    return {
        "f": K[[0, 1], [0, 1]], "c": K[:2, 2], "skew": K[0, 1],
        "k1": k1, "k2": k2, "p": np.array([p1, p2]),
        "rest": np.array([camera.width, camera.height, k3, K[1, 0], *K[2]]),
    }  # fmt: skip


def drawn(nominal: Nominal, seed: int = 11, world: int = 0, **knobs: float) -> dict[str, Array]:
    """The parts of a cell that is exact but for these knobs."""
    return parts(draw(nominal, Tolerances.model_validate(knobs), seed, world))


def matches(name: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def value(knob: str) -> float:
    return float(getattr(EVERYTHING, knob))


def in_si(knob: str) -> float:
    """The knob's value in EVERYTHING, in SI units."""
    factors = [factor for suffix, factor in UNITS.items() if knob.endswith(suffix)]
    return value(knob) * (factors[0] if factors else 1.0)


def distribution(knob: str) -> str:
    extra = Tolerances.model_fields[knob].json_schema_extra
    assert isinstance(extra, dict)
    return str(extra["distribution"])


def owned(names: Iterable[str], knob: str) -> set[str]:
    return {name for name in names if matches(name, OWNED[knob].split())}


def shared(names: Iterable[str]) -> set[str]:
    """The parts that two knobs move."""
    return {n for n in names if sum(matches(n, OWNED[knob].split()) for knob in KNOBS) > 1}
