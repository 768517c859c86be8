"""Draws an as-built cell from tolerances and a seed.

Every draw has its own random stream, keyed by (seed, world, trial, name): a source that is
switched on or off leaves all other draws as they were.
"""

import zlib

import numpy as np

from aoicell.camera import Camera
from aoicell.nominal import Nominal
from aoicell.observation import CameraName
from aoicell.sim.as_built import (
    Arrival,
    AsBuilt,
    Geometry,
    Light,
    PrintScale,
    Sensor,
    Surfaces,
    designed,
)
from aoicell.sim.tolerances import Tolerances
from aoicell.transforms import SE3, Array, from_rvec, from_xyz_rpy

LAMPS = 2  # the most that a room may have and still have each turned by its own draw


def stream(seed: int, world: int, trial: int, name: str) -> np.random.Generator:
    """The random stream of one named quantity; trial -1 belongs to the world itself."""
    return np.random.default_rng([seed, world, trial + 1, zlib.crc32(name.encode())])


def draw(nominal: Nominal, tolerances: Tolerances, seed: int, world: int = 0) -> AsBuilt:
    """Draw a cell. The same arguments give the same cell, on any machine and in any order."""
    drawing = _Drawing(nominal, tolerances, seed, world)
    return AsBuilt(
        geometry=drawing.geometry(),
        arrival=drawing.arrival(),
        sensors={name: drawing.sensor(name) for name in nominal.cameras},
        light=drawing.light(),
        surfaces=drawing.surfaces(),
        seed=seed,
        world=world,
    )


class _Drawing:
    """One drawing of a cell from its tolerances."""

    def __init__(self, nominal: Nominal, tolerances: Tolerances, seed: int, world: int) -> None:
        self.nominal, self.t = nominal, tolerances
        self.key = (seed, world)

    # -- streams --

    def normal(self, name: str, sigma: float, size: int = 1) -> Array:
        return sigma * stream(*self.key, -1, name).standard_normal(size)

    def factor(self, name: str, percent: float) -> float:
        return float(max(1 + self.normal(name, percent / 100)[0], 0.05))

    def motion(self, name: str, mm: float, deg: float) -> SE3:
        """A small rigid motion: `mm` along and `deg` about each axis."""
        turn = np.radians(self.normal(f"{name}_deg", deg, 3))
        return from_rvec(turn, self.normal(f"{name}_mm", mm, 3) / 1e3)

    def placed(self, name: str) -> SE3:
        """A small motion in the plane of the table."""
        x, y = self.normal(f"{name}_mm", self.t.placement_mm, 2) / 1e3
        turn = np.radians(self.normal(f"{name}_deg", self.t.placement_deg)[0])
        return from_xyz_rpy([x, y, 0], [0, 0, turn])

    # -- the parts of a cell --

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
            T_base_board=n.T_base_board * self.placed("board") * self.stand(),
            Ts_board_marker={id: T * self.marker(id) for id, T in design.Ts_board_marker.items()},
            cameras={name: self.camera(name, camera) for name, camera in n.cameras.items()},
            print_scales={name: self.print_scale(name) for name in design.print_scales},
            bows={name: self.bow(name) for name in design.bows},
        )

    def stand(self) -> SE3:
        """The board's height over the table and its tilt."""
        height = self.normal("board_thickness", self.t.board_thickness_mm)[0] / 1e3
        tilt_x, tilt_y = np.radians(self.normal("board_tilt", self.t.board_tilt_deg, 2))
        return from_rvec([tilt_x, tilt_y, 0], [0, 0, height])

    def marker(self, id: str) -> SE3:
        x, y = self.normal(f"marker_{id}_mm", self.t.marker_mm, 2) / 1e3
        z = self.normal(f"marker_{id}_lift", self.t.marker_lift_mm)[0] / 1e3
        turn = np.radians(self.normal(f"marker_{id}_deg", self.t.marker_deg)[0])
        return from_xyz_rpy([x, y, z], [0, 0, turn])

    def camera(self, name: CameraName, design: Camera) -> Camera:
        t, K = self.t, np.array(design.K)
        K[[0, 1], [0, 1]] *= 1 + self.normal(f"{name}_focal", t.focal_percent / 100)[0]
        K[:2, 2] += self.normal(f"{name}_principal", t.principal_px, 2)
        K[0, 1] = self.normal(f"{name}_skew", t.skew_px)[0]
        k1 = t.k1 + self.normal(f"{name}_k1", t.k1_sigma)[0]
        k2 = self.normal(f"{name}_k2", t.k2_sigma)[0]
        p1, p2 = self.normal(f"{name}_tangential", t.tangential_sigma, 2)
        return Camera(K, design.width, design.height, np.array([k1, k2, p1, p2, 0]))

    def print_scale(self, name: str) -> PrintScale:
        board = {"armtarget": self.nominal.armtarget, "tabletarget": self.nominal.tabletarget}
        marker = self.nominal.marker.size
        width, height = board[name].size if name in board else (marker, marker)
        dx, dy = self.normal(f"print_{name}", self.t.print_um, 2) / 1e6
        return (1 + dx / width, 1 + dy / height)

    def bow(self, name: str) -> tuple[float, float]:
        bow = self.normal(f"bow_{name}", self.t.bow_mm)[0] / 1e3
        return float(bow), float(self.normal(f"twist_{name}", self.t.twist_mm)[0] / 1e3)

    def arrival(self) -> Arrival:
        t = self.t
        return Arrival(
            # ISO 9283: RP = mean + 3 sigma of the distance, taken as 3.6 sigma of one axis
            repeatability_sigma=t.repeatability_mm / 1e3 / 3.6,
            backlash=float(np.radians(t.backlash_deg)),
            compliance=float(np.radians(t.compliance_deg_per_kNm) / 1e3),
            settle=t.settle_mm / 1e3,
            settle_time=t.settle_ms / 1e3,
            wait=t.wait_ms / 1e3,
            lag=t.lag_ms / 1e3,
        )

    def sensor(self, name: CameraName) -> Sensor:
        t = self.t
        drift = self.normal("focal_drift", t.focal_drift_ppm)[0] / 1e6 if name == "hand" else 0.0
        return Sensor(
            psf_px=t.psf_px,
            aperture=t.aperture_mm / 1e3,
            focus=t.focus_mm / 1e3 if name == "hand" else 0.0,  # the tripod's is set on its boards
            exposure=t.exposure_ms / 1e3,
            brightness=self.factor(f"{name}_exposure", t.exposure_percent),
            vignetting=t.vignetting_percent / 100,
            gain=t.electrons_per_grey,
            noise_grey=t.noise_grey,
            adc_bits=round(t.adc_bits),
            focal_drift=float(drift),
        )

    def light(self) -> Light:
        t = self.t
        # warmer light is redder: +-300 K about 5500 K change R against B by some 5 %
        warm = float(np.clip(-self.normal("light_kelvin", t.light_kelvin)[0] / 5500, -1, 1))
        turns = np.radians(self.normal("light_deg", t.light_deg, 3 * LAMPS)).reshape(LAMPS, 3)
        direction = stream(*self.key, -1, "gradient").uniform(0, 2 * np.pi)
        slope = t.gradient_percent / 100 * np.array([np.cos(direction), np.sin(direction)])
        return Light(
            level=self.factor("light", t.light_percent),
            colour=(1 + warm / 2, 1.0, 1 - warm / 2),
            turns=tuple((float(x), float(y), float(z)) for x, y, z in turns),
            gradient=(float(slope[0]), float(slope[1])),
            flicker=t.flicker_percent / 100,
            shadows=t.shadows > 0,
        )

    def surfaces(self) -> Surfaces:
        t, ids = self.t, [component.id for component in self.nominal.board.components]
        heights = self.normal("component_height", t.component_height_mm, len(ids)) / 1e3
        tones = 1 + self.normal("component_colour", t.component_colour_percent / 100, len(ids))
        return Surfaces(
            heights=dict(zip(ids, heights.tolist(), strict=True)),
            brightness=dict(zip(ids, np.clip(tones, 0.3, 2).tolist(), strict=True)),
            dust=t.dust_percent / 100,
            occlusion=t.occlusion_percent / 100,
            glare=t.glare,
            seed=self.key,
        )
