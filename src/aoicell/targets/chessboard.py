"""Chessboards: geometry, print, detection.

The frame of a board has its origin at the centre of the corner grid, x to the right
and y up as one looks at the print, z out of the print. A board with an odd number of
squares both ways looks the same after a half turn: `half_turn` gives the other reading
and the caller settles it from the robot's motion.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from aoicell.errors import TargetNotFound
from aoicell.observation import Image
from aoicell.targets.edges import Strips, fit_lines, intersections, step_offsets
from aoicell.transforms import Array


@dataclass(frozen=True)
class Chessboard:
    """A chessboard of `columns` x `rows` inner corners and squares of `square` metres."""

    columns: int
    rows: int
    square: float
    margin: float = 0.0

    @property
    def corners(self) -> Array:
        """Inner corners (N, 3) in the board's frame (m), row by row from the top left."""
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.square
        y = ((self.rows - 1) / 2 - np.arange(self.rows)) * self.square
        grid_x, grid_y = np.meshgrid(x, y)
        return np.column_stack([grid_x.ravel(), grid_y.ravel(), np.zeros(grid_x.size)])

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the printed plate (m), white margin included."""
        return (
            (self.columns + 1) * self.square + 2 * self.margin,
            (self.rows + 1) * self.square + 2 * self.margin,
        )

    @property
    def outline(self) -> Array:
        """The plate's four corners (4, 3) in the board's frame (m)."""
        w, h = self.size
        return np.array([[-w, h, 0], [w, h, 0], [w, -h, 0], [-w, -h, 0]]) / 2

    def print_image(self, pixels_per_square: int = 80) -> Image:
        """The print as seen from the front, white margin included (H, W)."""
        squares = np.indices((self.rows + 1, self.columns + 1)).sum(axis=0) % 2
        tile = np.ones((pixels_per_square, pixels_per_square))
        image = np.kron(squares, tile) * 255
        border = round(self.margin / self.square * pixels_per_square)
        return np.pad(image, border, constant_values=255).astype(np.uint8)

    def detect(self, grey: Image, name: str = "chessboard") -> Array:
        """Inner corners (N, 2) in px, in the order of `corners` up to a half turn.

        Raises TargetNotFound when a corner, or half of an outer square, is not in the picture.
        """
        found = self._coarse(grey)
        if found is None:
            raise TargetNotFound(
                f"{name}: no chessboard of {self.columns}x{self.rows} inner corners in the "
                f"{grey.shape[1]}x{grey.shape[0]} picture; bring all of it into view, in focus"
            )
        uv = self._refine(grey, found)
        reach = 0.5 * np.max([np.linalg.norm(step, axis=1).max() for step in self._steps(uv)])
        if (uv < reach).any() or (uv > np.array(grey.shape[::-1]) - 1 - reach).any():
            raise TargetNotFound(
                f"{name}: the outer squares are cut off by the edge of the picture; "
                "bring all of the board into view"
            )
        return uv

    def detect_pair(self, grey: Image, name: str = "chessboards") -> tuple[Array, Array]:
        """Corners of two boards of this layout in one picture, larger image first."""
        first = self.detect(grey, name)
        hull = cv2.convexHull(self._grown(first).astype(np.float32)).astype(np.int32)
        masked = cv2.fillConvexPoly(grey.copy(), hull, 128)
        second = self.detect(np.asarray(masked, dtype=np.uint8), name)
        areas = [cv2.contourArea(cv2.convexHull(uv.astype(np.float32))) for uv in (first, second)]
        return (first, second) if areas[0] >= areas[1] else (second, first)

    def _coarse(self, grey: Image) -> Array | None:
        """Detection at half size, where it is quick, else at full size."""
        pattern = (self.columns, self.rows)
        small = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        ok, corners = cv2.findChessboardCornersSB(small, pattern)
        if ok:
            return np.asarray(corners, dtype=float)[:, 0] * 2 + 0.5  # pixel centres are integers
        ok, corners = cv2.findChessboardCornersSB(grey, pattern, flags=cv2.CALIB_CB_EXHAUSTIVE)
        return np.asarray(corners, dtype=float)[:, 0] if ok else None

    def _refine(self, grey: Image, uv_px: Array) -> Array:
        """Each corner as the crossing of the two edges that run through it."""
        uv = self._clockwise(uv_px)
        for _ in range(2):
            x, y = self._steps(uv)
            along_x = _edge_lines(grey, uv, x, y)
            along_y = _edge_lines(grey, uv, y, x)
            moved = intersections(uv, x, y, along_x, along_y)
            close = np.linalg.norm(moved - uv, axis=1) < 0.3 * np.linalg.norm(x, axis=1)
            if not close.all():  # NaN where there is no contrast
                break
            uv = moved
        return uv

    def _clockwise(self, uv_px: Array) -> Array:
        """Seen from the front, a column step turns clockwise into a row step (y is down)."""
        x, y = self._steps(uv_px)
        if np.sum(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) > 0:
            return uv_px
        return uv_px.reshape(self.rows, self.columns, 2)[:, ::-1].reshape(-1, 2)

    def _steps(self, uv_px: Array) -> tuple[Array, Array]:
        """Local vectors (N, 2) to the next column and to the next row (px)."""
        grid = uv_px.reshape(self.rows, self.columns, 2)
        x = np.asarray(np.gradient(grid, axis=1)).reshape(-1, 2)
        return x, np.asarray(np.gradient(grid, axis=0)).reshape(-1, 2)

    def _grown(self, uv_px: Array) -> Array:
        """The corner grid's outer points pushed out to the edge of the plate (px)."""
        centre = uv_px.mean(axis=0)
        grown: Array = centre + (uv_px - centre) * (1 + 3.2 / (self.rows - 1))
        return grown


def _edge_lines(grey: Image, uv_px: Array, along: Array, across: Array) -> tuple[Array, Array]:
    """Lines through the edges along `along`, from both sides of each corner.

    The profiles are short, five pixels or an eighth of a square to each side: uneven light
    shifts an area-based edge by the square of their length.
    """
    half = float(np.clip(5.0 / np.linalg.norm(across, axis=1).min(), 0.12, 0.25))
    u = np.linspace(-half, half, 33)
    sides = [np.linspace(-0.42, -0.12, 24), np.linspace(0.12, 0.42, 24)]
    offsets = [step_offsets(Strips(uv_px, along, across, t, u).sample(grey), u) for t in sides]
    return fit_lines(np.concatenate(sides), np.concatenate(offsets, axis=1), 0.02 * half)


def half_turn(uv_px: Array) -> Array:
    """The other reading of an even board: the same corners after a turn by 180 deg."""
    return uv_px[::-1]
