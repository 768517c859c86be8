"""The cell as it was really built: tolerances and a seed give a drawn geometry.

Every draw has its own random stream, keyed by (seed, world, trial, name): a source that is
switched on or off leaves all other draws as they were.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from aoicell.camera import Camera
from aoicell.nominal import Nominal
from aoicell.observation import CameraName
from aoicell.sim.tolerances import Tolerances
from aoicell.transforms import SE3, Array, from_rvec, from_xyz_rpy


def stream(seed: int, world: int, trial: int, name: str) -> np.random.Generator:
    """The random stream of one named quantity; trial -1 belongs to the world itself."""
    return np.random.default_rng([seed, world, trial + 1, zlib.crc32(name.encode())])


@dataclass(frozen=True)
class Geometry:
    """Where everything is and which cameras look at it: all that a picture depends on.

    `joint_corrections` act in each joint's own frame, after its URDF origin; the last one
    belongs to the flange. `Ts_board_marker` go by marker id.
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


@dataclass(frozen=True)
class AsBuilt:
    """A drawn cell: its geometry, and what varies from picture to picture."""

    geometry: Geometry
    repeatability_sigma: float
    noise_grey: float
    seed: int
    world: int


def designed(nominal: Nominal) -> Geometry:
    """The geometry of the design, exactly."""
    dof = nominal.arm.dof
    return Geometry(
        joint_corrections=(SE3.Identity(),) * (dof + 1),
        joint_offsets=np.zeros(dof),
        T_flange_camera=nominal.T_flange_camera,
        T_flange_armtarget=nominal.T_flange_armtarget,
        T_base_tabletarget=nominal.T_base_tabletarget,
        T_base_tripod=nominal.T_base_tripod,
        T_base_board=nominal.T_base_board,
        Ts_board_marker={
            m.id: from_xyz_rpy([m.x, m.y, m.z], [0, 0, m.rotation]) for m in nominal.board.markers
        },
        cameras=dict(nominal.cameras),
    )


def draw(nominal: Nominal, tolerances: Tolerances, seed: int, world: int = 0) -> AsBuilt:
    """Draw a cell. The same arguments give the same cell, on any machine and in any order."""
    return AsBuilt(
        geometry=_Draw(nominal, tolerances, seed, world).geometry(),
        # ISO 9283: RP = mean + 3 sigma of the distance, 3.6 times the sigma of one axis
        repeatability_sigma=tolerances.repeatability_mm / 1e3 / 3.6,
        noise_grey=tolerances.noise_grey,
        seed=seed,
        world=world,
    )


class _Draw:
    """One drawing of a cell from its tolerances."""

    def __init__(self, nominal: Nominal, tolerances: Tolerances, seed: int, world: int) -> None:
        self.nominal, self.t = nominal, tolerances
        self.key = (seed, world)

    def normal(self, name: str, sigma: float, size: int | tuple[int, ...]) -> Array:
        return sigma * stream(*self.key, -1, name).standard_normal(size)

    def motion(self, name: str, mm: float, deg: float) -> SE3:
        """A small rigid motion: `mm` along and `deg` about each axis."""
        turn = np.radians(self.normal(f"{name}_deg", deg, 3))
        return from_rvec(turn, self.normal(f"{name}_mm", mm, 3) / 1e3)

    def placed(self, name: str) -> SE3:
        """A small motion in the plane of the table."""
        x, y = self.normal(f"{name}_mm", self.t.placement_mm, 2) / 1e3
        turn = np.radians(self.normal(f"{name}_deg", self.t.placement_deg, 1)[0])
        return from_xyz_rpy([x, y, 0], [0, 0, turn])

    def geometry(self) -> Geometry:
        n, t = self.nominal, self.t
        design = designed(n)
        bias = np.array([t.mount_bias_x_mm, 0, t.mount_bias_z_mm]) / 1e3
        mount = SE3(np.eye(3), bias) * n.T_flange_camera
        return Geometry(
            joint_corrections=tuple(
                self.motion(f"link_{i}", t.link_mm, t.axis_deg) for i in range(n.arm.dof + 1)
            ),
            joint_offsets=np.radians(self.normal("joint_zero", t.joint_zero_deg, n.arm.dof)),
            T_flange_camera=mount * self.motion("mount", t.mount_mm, t.mount_deg),
            T_flange_armtarget=n.T_flange_armtarget
            * self.motion("bracket", t.bracket_mm, t.bracket_deg),
            T_base_tabletarget=n.T_base_tabletarget * self.placed("tabletarget"),
            T_base_tripod=n.T_base_tripod * self.motion("tripod", t.tripod_mm, t.tripod_deg),
            T_base_board=n.T_base_board * self.placed("board"),
            Ts_board_marker={id: T * self.marker(id) for id, T in design.Ts_board_marker.items()},
            cameras={name: self.camera(name, camera) for name, camera in n.cameras.items()},
        )

    def marker(self, id: str) -> SE3:
        x, y = self.normal(f"marker_{id}_mm", self.t.marker_mm, 2) / 1e3
        turn = np.radians(self.normal(f"marker_{id}_deg", self.t.marker_deg, 1)[0])
        return from_xyz_rpy([x, y, 0], [0, 0, turn])

    def camera(self, name: CameraName, design: Camera) -> Camera:
        t = self.t
        K = np.array(design.K)
        K[[0, 1], [0, 1]] *= 1 + self.normal(f"{name}_focal", t.focal_percent / 100, 1)[0]
        K[:2, 2] += self.normal(f"{name}_principal", t.principal_px, 2)
        k1 = t.k1 + self.normal(f"{name}_k1", t.k1_sigma, 1)[0]
        return Camera(K, design.width, design.height, np.array([k1, 0, 0, 0, 0]))
