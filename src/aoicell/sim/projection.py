"""Pictures left out: target points by projection of the truth, plus measured detection noise.

For studies of thousands of cells. Whether it gives the same distribution of residuals as
rendered pictures is measured, not assumed: see the error budget.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from aoicell.camera import Camera
from aoicell.errors import TargetNotFound
from aoicell.observation import CameraName, Observation, RobotState
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import stream
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.cross_marker import CrossMarker
from aoicell.transforms import SE3, Array

_NO_PICTURE = np.zeros((0, 0), dtype=np.uint8)


@dataclass(frozen=True)
class DetectionNoise:
    """Standard deviation of a detected point, per coordinate (px)."""

    corner_px: float
    cross_px: float


# Measured in rendered pictures of four worlds each of `typical` and `paper`, after the geometry is
# accounted for: what the noise of the sensor leaves, and what dust adds where it covers 1 %.
SENSOR_NOISE = DetectionNoise(corner_px=0.014, cross_px=0.004)
DUST_NOISE = DetectionNoise(corner_px=0.070, cross_px=0.036)


def measured_noise(tolerances: Tolerances) -> DetectionNoise:
    """The detection noise that belongs to the sensor and the dust of these tolerances.

    The first grows with the standard deviation of the grey values, the second with the square
    root of the covered share; zero without noise and dust.
    """

    def power(t: Tolerances) -> float:
        shot = 128 / t.electrons_per_grey if t.electrons_per_grey > 0 else 0.0
        return t.noise_grey**2 + shot

    noise = float(np.sqrt(power(tolerances) / power(TYPICAL)))
    dust = float(np.sqrt(tolerances.dust_percent))
    return DetectionNoise(
        corner_px=float(np.hypot(noise * SENSOR_NOISE.corner_px, dust * DUST_NOISE.corner_px)),
        cross_px=float(np.hypot(noise * SENSOR_NOISE.cross_px, dust * DUST_NOISE.cross_px)),
    )


class PicturelessCell:
    """The `Cell` protocol without rendering: observations hold no picture, only their instant."""

    __slots__ = ("_cell", "_world")

    def __init__(self, world: World) -> None:
        self._world, self._cell = world, SimCell(world)

    def move(self, q: ArrayLike) -> None:
        """Drive to q (rad), as `SimCell` does."""
        self._cell.move(q)

    def state(self) -> RobotState:
        """What the controller believes."""
        return self._cell.state()

    def capture(self, camera: CameraName = "hand") -> Observation:
        """An observation without a picture."""
        return self._world.observe(Observation(_NO_PICTURE, self.state(), camera))


class ProjectingDetector:
    """The `Detector` protocol from the truth behind each observation."""

    def __init__(self, world: World, noise: DetectionNoise) -> None:
        self._world, self._noise = world, noise

    def chessboard(self, observation: Observation, board: Chessboard, name: str) -> Array:
        """Corners of chessboard 2, as the hand camera sees it."""
        T_base_board = self._world.geometry.T_base_tabletarget
        return self._board(observation, "tabletarget", board, T_base_board, name)

    def chessboard_pair(
        self, observation: Observation, board: Chessboard, name: str
    ) -> tuple[Array, Array]:
        """Corners of chessboard 1 and 2, as the tripod sees them."""
        world, truth = self._world, self._world.truth_of(observation)
        first = self._board(observation, "armtarget", board, truth.T_base_armtarget, name)
        table, T_base_table = world.nominal.tabletarget, world.geometry.T_base_tabletarget
        return first, self._board(observation, "tabletarget", table, T_base_table, name)

    def _board(
        self, observation: Observation, which: str, board: Chessboard, T_base_board: SE3, name: str
    ) -> Array:
        camera, T_base_camera = self._eye(observation)
        T_camera_board = T_base_camera.actInv(T_base_board)
        if not camera.sees(board.corners, T_camera_board, margin_px=5.0):
            raise TargetNotFound(f"{name}: {which} is not completely in the picture")
        points = self._world.board_points(which)
        return self._noisy(observation, which, camera.project(points, T_camera_board),
                           self._noise.corner_px)  # fmt: skip

    def markers(self, observation: Observation, marker: CrossMarker) -> list[Array]:
        """Cross centres of every marker that lies in the picture as a whole."""
        camera, T_base_camera = self._eye(observation)
        T_camera_board = T_base_camera.actInv(self._world.truth_of(observation).T_base_board)
        found = []
        for id, T_board_marker in self._world.geometry.Ts_board_marker.items():
            T_camera_marker = T_camera_board * T_board_marker
            if camera.sees(marker.outline, T_camera_marker, margin_px=2.0):
                uv = camera.project(self._world.marker_crosses(id), T_camera_board)
                found.append(self._noisy(observation, id, uv, self._noise.cross_px))
        return found

    def _eye(self, observation: Observation) -> tuple[Camera, SE3]:
        truth = self._world.truth_of(observation)
        if observation.camera == "tripod":
            return self._world.camera("tripod"), self._world.geometry.T_base_tripod
        return truth.camera, truth.T_base_camera

    def _noisy(self, observation: Observation, what: str, uv: Array, sigma_px: float) -> Array:
        """The points with the noise of this picture and target, the same however often asked."""
        truth, built = self._world.truth_of(observation), self._world.as_built
        rng = stream(built.seed, built.world, truth.trial, f"pixels_{truth.picture}_{what}")
        noisy: Array = uv + sigma_px * rng.standard_normal(uv.shape)
        return noisy
