"""Pictures left out: target points by projection of the truth, with measured detection errors.

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
from aoicell.targets.marker import Marker
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.transforms import SE3, Array

_NO_PICTURE = np.zeros((0, 0), dtype=np.uint8)


@dataclass(frozen=True)
class DetectionNoise:
    """Standard deviations of the errors of a detected point, per coordinate.

    `corner_px` and `cross_px`: by the sensor's noise, anew in each picture. `corner_dust` and
    `cross_dust` (m): by dust, which moves a point on its print, the same in all pictures.
    """

    corner_px: float = 0.0
    cross_px: float = 0.0
    corner_dust: float = 0.0
    cross_dust: float = 0.0


# Measured in rendered pictures, detected minus projected points. The sensor: 10 worlds of `paper`
# without dust, whose sensor is that of `typical`. The dust: the same pictures with dust less those
# without, of 8 worlds of `ideal` with 1 %, 5 with 0.1 % and 10 worlds of `paper` with 0.5 %, taken
# back to the print and divided by the root of the percentage: 18, 20 and 16 um a coordinate of a
# corner, 8.3, 8.2 and 6.9 um of a cross.
#
# The specks are fixed to the print, and so is most of what they do: two pictures of a cross from
# the same distance share 98 to 99.9 % of the variance, from different distances 91 to 94 %; those
# of a corner in the hand camera 98 %, of chessboard 1 in the tripod 69 to 79 %. The rest is no
# larger than the sensor's noise, about, and left out. The hand camera and the tripod share nothing
# (correlation -0.1 to -0.3): they look at strips of another width. The points of a print and their
# two coordinates are uncorrelated. From 0.5 % on the errors of crosses are nearly normal (excess
# kurtosis 0.4 to 0.7); at 0.1 % most points have none and a few have much (5), which is left out.
# So are two rarer things: bars that run along the pixel raster (0.01 px a cross, common to the
# marker), and a speck at the edge that the robust line takes in one picture and leaves in another.
SENSOR_NOISE = DetectionNoise(corner_px=0.011, cross_px=0.006)
DUST_NOISE = DetectionNoise(corner_dust=17e-6, cross_dust=7.5e-6)  # where dust covers 1 %


@dataclass(frozen=True)
class PointNoise:
    """Errors of the points of a kind of marker, in those of a cross."""

    sensor: float = 1.0
    dust: float = 1.0


# Measured like the errors of crosses, in 2 worlds of `typical` without dust and with 1 %, four
# pictures each at 1.15 m (16 markers) and at 0.5 m (4): 0.026 px and 15 to 17 um a coordinate of a
# tag's corner, 0.006 px and 3 to 7 um of a ChArUco board's outer corners. Those of coded markers
# are those of plain ones.
NOISE_OVER_CROSS = {"apriltag": PointNoise(4.4, 2.1), "charuco": PointNoise(1.0, 0.7)}


def measured_noise(tolerances: Tolerances) -> DetectionNoise:
    """The detection errors that belong to the sensor and the dust of these tolerances.

    The first grow with the standard deviation of the grey values, the second with the square
    root of the covered share; zero without noise and dust.
    """

    def power(t: Tolerances) -> float:
        shot = 128 / t.electrons_per_grey if t.electrons_per_grey > 0 else 0.0
        return t.noise_grey**2 + shot

    noise = float(np.sqrt(power(tolerances) / power(TYPICAL)))
    dust = float(np.sqrt(tolerances.dust_percent))
    return DetectionNoise(
        corner_px=noise * SENSOR_NOISE.corner_px,
        cross_px=noise * SENSOR_NOISE.cross_px,
        corner_dust=dust * DUST_NOISE.corner_dust,
        cross_dust=dust * DUST_NOISE.cross_dust,
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
        # the tripod finds the corners from other parts of the edges than the hand camera
        dust = self._dust(f"{which}_{observation.camera}", board.corners, self._noise.corner_dust)
        uv = camera.project(self._world.board_points(which) + dust, T_camera_board)
        return self._noisy(observation, which, uv, self._noise.corner_px)

    def markers(self, observation: Observation, marker: Marker) -> list[Array]:
        """Cross centres of every marker that lies in the picture as a whole."""
        return [seen.uv_px for seen in self.sightings(observation, marker)]

    def sightings(
        self, observation: Observation, marker: Marker, camera: Camera | None = None
    ) -> list[MarkerSighting]:
        """The same with the codes of the board's markers and the noise that they are given.

        `camera`, what an estimator takes for the lens, changes nothing here.
        """
        eye, T_base_camera = self._eye(observation)
        T_camera_board = T_base_camera.actInv(self._world.truth_of(observation).T_base_board)
        found = []
        for design in self._world.nominal.board.markers:
            T_board_marker = self._world.geometry.Ts_board_marker[design.id]
            T_camera_marker = T_camera_board * T_board_marker
            if eye.sees(marker.outline, T_camera_marker, margin_px=2.0):
                times = NOISE_OVER_CROSS.get(design.kind, PointNoise())
                px, moved = times.sensor * self._noise.cross_px, times.dust * self._noise.cross_dust
                dust = self._dust(design.id, marker.crosses, moved)
                crosses = self._world.marker_crosses(design.id) + dust @ T_board_marker.rotation.T
                uv = self._noisy(observation, design.id, eye.project(crosses, T_camera_board), px)
                scale = eye.focal_px / np.linalg.norm(T_camera_marker.translation)
                sigma = np.full(4, np.hypot(px, moved * scale))
                found.append(MarkerSighting(uv, sigma, design.code or None))
        return found

    def _eye(self, observation: Observation) -> tuple[Camera, SE3]:
        truth = self._world.truth_of(observation)
        if observation.camera == "tripod":
            return self._world.camera("tripod"), self._world.geometry.T_base_tripod
        return truth.camera, truth.T_base_camera

    def _dust(self, name: str, points: Array, sigma: float) -> Array:
        """Where dust seems to move the points (N, 3) of a print, in its own frame (m)."""
        built = self._world.as_built
        rng = stream(built.seed, built.world, -1, f"dust_offsets_{name}")
        return np.pad(sigma * rng.standard_normal((len(points), 2)), ((0, 0), (0, 1)))

    def _noisy(self, observation: Observation, what: str, uv: Array, sigma_px: float) -> Array:
        """The points with the noise of this picture and target, the same however often asked."""
        truth, built = self._world.truth_of(observation), self._world.as_built
        rng = stream(built.seed, built.world, truth.trial, f"pixels_{truth.picture}_{what}")
        noisy: Array = uv + sigma_px * rng.standard_normal(uv.shape)
        return noisy
