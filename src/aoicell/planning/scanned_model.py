"""From depth images to a model of the board: one surface, its frame, its colours, its bumps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from aoicell.errors import Refused
from aoicell.observation import Image, RobotState
from aoicell.planning.bumps import Bump, BumpConfig, find_bumps
from aoicell.planning.depth import DepthImage
from aoicell.planning.fusion import FromAbove, FusionConfig, Surface, fuse, simplified
from aoicell.planning.heights import HeightField
from aoicell.planning.orthophoto import orthophoto
from aoicell.planning.scan import ScanArea
from aoicell.planning.scanned_board import BoardConfig, ScannedBoard, find_board
from aoicell.transforms import SE3, Array


@dataclass(frozen=True)
class ModelConfig:
    """The configs of the stages; `coarse` and `cell` (m) of the rasters in which the board and its
    bumps are looked for, `rim` (m) around the board that the finer one has, `triangle` (m): what
    the mesh is simplified to.
    """

    fusion: FusionConfig = field(default_factory=FusionConfig)
    board: BoardConfig = field(default_factory=BoardConfig)
    bumps: BumpConfig = field(default_factory=BumpConfig)
    coarse: float = 0.0005
    cell: float = 0.00025
    rim: float = 0.008
    triangle: float = 0.001


@dataclass(frozen=True, eq=False)
class ScannedModel:
    """A scanned board. `surface`, `heights` and `bumps` are in its frame, `photo` (rows, columns,
    3) has the raster of `heights`.
    """

    T_base_board: SE3
    board: ScannedBoard
    surface: Surface
    heights: HeightField
    photo: Image
    bumps: tuple[Bump, ...]

    @property
    def uv(self) -> Array:
        """Places (N, 2) of the vertices in the photo, 0 to 1 from its first row and column."""
        rows, columns = self.heights.heights.shape
        cells = (self.surface.vertices[:, :2] - self.heights.origin) / self.heights.cell + 0.5
        return np.asarray(cells / [columns, rows])

    @property
    def middle(self) -> tuple[float, float]:
        """The middle of the box around the surface (m): the origin of the files that are written,
        as planning on a mesh has it.
        """
        low, high = self.surface.vertices.min(axis=0), self.surface.vertices.max(axis=0)
        x, y = (low + high)[:2] / 2
        return float(x), float(y)

    def write_mesh(self, path: Path) -> None:
        """The surface with a colour for each vertex, in metres; origin: see `middle`."""
        import trimesh  # only where a mesh is written: it takes long to import

        places = self.uv * self.photo.shape[1::-1] - 0.5
        last = np.array(self.photo.shape[1::-1]) - 1
        column, row = np.clip(np.rint(places), 0, last).astype(int).T
        mesh = trimesh.Trimesh(
            self.surface.vertices - [*self.middle, 0.0], self.surface.faces, process=False,
            vertex_colors=self.photo[row, column],
        )  # fmt: skip
        mesh.export(path)

    def rows(self) -> list[dict[str, str | float]]:
        """A line for each bump in pick-and-place form, the highest first; origin: see `middle`."""
        return [
            {
                "designator": f"B{number:03d}",
                "x_mm": round((bump.x - self.middle[0]) * 1e3, 3),
                "y_mm": round((bump.y - self.middle[1]) * 1e3, 3),
                "rotation_deg": round(float(np.degrees(bump.rotation)), 2),
                "side": "top",
                "width_mm": round(bump.width * 1e3, 3),
                "depth_mm": round(bump.depth * 1e3, 3),
                "height_mm": round(bump.height * 1e3, 3),
            }
            for number, bump in enumerate(self.bumps, start=1)
        ]


def build_model(
    images: Sequence[DepthImage],
    T_base_camera: Callable[[RobotState], SE3],
    area: ScanArea,
    config: ModelConfig | None = None,
) -> ScannedModel:
    """The model of the board that lies in an area, from depth images of it.

    `T_base_camera` gives the camera's pose for a state of the robot, by whichever calibration.
    Raises Refused when no board is found there.
    """
    config = config or ModelConfig()
    fused = fuse(images, T_base_camera, area, config.fusion)
    above = FromAbove(fused)
    board = find_board(above.heights((area.width, area.depth), config.coarse), config.board)
    size = (board.size[0] + 2 * config.rim, board.size[1] + 2 * config.rim)
    heights = above.heights(size, config.cell, board.T_area_board)
    local = fused.moved(board.T_area_board.inverse())
    T_base_board = area.T_base_area * board.T_area_board
    Ts_board_camera = [T_base_board.actInv(T_base_camera(image.state)) for image in images]
    return ScannedModel(
        T_base_board,
        board,
        simplified(_cropped(local, size, -board.size[2] / 2), config.triangle),
        heights,
        orthophoto(images, Ts_board_camera, heights),
        tuple(find_bumps(heights, board.size[:2], config.bumps)),
    )


def _cropped(surface: Surface, size: tuple[float, float], floor: float) -> Surface:
    """The triangles over a rectangle of that size (m) and above a height (m), vertices renumbered.

    The table goes with that: what is left is the board.
    """
    x, y, z = surface.vertices.T
    inside = (np.abs(x) <= size[0] / 2) & (np.abs(y) <= size[1] / 2) & (z >= floor)
    faces = surface.faces[inside[surface.faces].all(axis=1)]
    if not len(faces):
        raise Refused("scan: nothing of the surface lies on the board")
    used, numbers = np.unique(faces, return_inverse=True)
    return Surface(surface.vertices[used], numbers.reshape(-1, 3))
