"""The cell as it was really built: what a drawing from tolerances consists of.

`Geometry` is all that decides where a point appears; the other parts decide how the arm
arrives and how light becomes grey values.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from aoicell.camera import Camera
from aoicell.nominal import Nominal
from aoicell.observation import CameraName
from aoicell.transforms import SE3, Array, from_xyz_rpy

PrintScale = tuple[float, float]  # printed over designed size, along x and y


@dataclass(frozen=True)
class Geometry:
    """Where everything is and which cameras look at it.

    `joint_corrections` act in each joint's own frame, after its URDF origin; the last one
    belongs to the flange. `Ts_board_marker` go by marker id, `print_scales` by the name of
    the print (armtarget, tabletarget, marker ids), `bows` (centre over edges, two opposite
    corners over the others; m) by chessboard.
    """

    joint_corrections: tuple[SE3, ...]
    joint_offsets: Array
    T_flange_camera: SE3
    T_flange_armtarget: SE3
    T_base_tabletarget: SE3
    T_base_tripod: SE3
    T_base_board: SE3
    Ts_board_marker: Mapping[str, SE3]
    cameras: Mapping[CameraName, Camera]
    print_scales: Mapping[str, PrintScale]
    bows: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Arrival:
    """How the arm stops. SI units.

    `repeatability_sigma` (m) per axis at the flange; `backlash` (rad) is the whole play of a
    joint; `compliance` (rad per N m) of each joint under gravity; the flange is still
    `settle` (m) from rest on arrival and gets there with time constant `settle_time`; the
    picture is taken `wait` after arrival and is `lag` older than the reported pose.
    """

    repeatability_sigma: float = 0.0
    backlash: float = 0.0
    compliance: float = 0.0
    settle: float = 0.0
    settle_time: float = 0.0
    wait: float = 0.0
    lag: float = 0.0


@dataclass(frozen=True)
class Sensor:
    """How light becomes grey values in one camera.

    `psf_px`: point spread in focus; `aperture` and `focus` (m) of the lens, focus 0 for all
    in focus; `exposure` (s); `brightness` factor; `vignetting`: share of light lost in the
    corners; `gain`: electrons a grey value, 0 without shot noise; `noise_grey`: read noise;
    `adc_bits`, 0 for exact; `focal_drift`: relative change of the focal length over a shift.
    """

    psf_px: float = 0.0
    aperture: float = 0.0
    focus: float = 0.0
    exposure: float = 0.0
    brightness: float = 1.0
    vignetting: float = 0.0
    gain: float = 0.0
    noise_grey: float = 0.0
    adc_bits: int = 0
    focal_drift: float = 0.0


@dataclass(frozen=True)
class Light:
    """The lamps: level factor, colour (3,) factors of R, G, B, rotation vectors (N, 3) of the
    lamps' directions (rad), gradient (2,) over half the picture's width and height (relative),
    flicker (sigma of the level from picture to picture), and whether shadows are cast.
    """

    level: float = 1.0
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    turns: tuple[tuple[float, float, float], ...] = ()
    gradient: tuple[float, float] = (0.0, 0.0)
    flicker: float = 0.0
    shadows: bool = False


@dataclass(frozen=True)
class Surfaces:
    """How parts and prints really look: height offsets (m) and brightness factors of components
    by id; share of each print under dust, share of each marker's edge that is covered; glare.

    `seed` (seed, world) is that of the streams which say where dust and covers lie.
    """

    heights: Mapping[str, float]
    brightness: Mapping[str, float]
    dust: float = 0.0
    occlusion: float = 0.0
    glare: float = 0.0
    seed: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class AsBuilt:
    """A drawn cell."""

    geometry: Geometry
    arrival: Arrival
    sensors: Mapping[CameraName, Sensor]
    light: Light
    surfaces: Surfaces
    seed: int
    world: int


def designed(nominal: Nominal) -> Geometry:
    """The geometry of the design, exactly."""
    dof = nominal.arm.dof
    markers = {
        m.id: from_xyz_rpy([m.x, m.y, m.z], [0, 0, m.rotation]) for m in nominal.board.markers
    }
    boards = ("armtarget", "tabletarget")
    return Geometry(
        joint_corrections=(SE3.Identity(),) * (dof + 1),
        joint_offsets=np.zeros(dof),
        T_flange_camera=nominal.T_flange_camera,
        T_flange_armtarget=nominal.T_flange_armtarget,
        T_base_tabletarget=nominal.T_base_tabletarget,
        T_base_tripod=nominal.T_base_tripod,
        T_base_board=nominal.T_base_board,
        Ts_board_marker=markers,
        cameras=dict(nominal.cameras),
        print_scales=dict.fromkeys((*boards, *markers), (1.0, 1.0)),
        bows=dict.fromkeys(boards, (0.0, 0.0)),
    )


def plain_surfaces() -> Surfaces:
    """Parts and prints as designed: clean, matt."""
    return Surfaces(heights={}, brightness={})
