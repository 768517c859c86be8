"""Chessboards: geometry, print, detection.

The frame of a board has its origin at the centre of the corner grid, x to the right
and y up as one looks at the print, z out of the print; the square in the top left corner is
black. OpenCV's frame for the same corners has its origin at the first corner, y down and z
into the print: `T_target_opencv`.

A board whose numbers of columns and rows are both even or both odd looks the same after a half
turn: `half_turn` gives the other reading and the caller settles it from the robot's motion. Any
other board is read by its colours.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from cv2.typing import MatLike

from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image
from aoicell.targets.crossings import (
    EdgeWindow,
    checker_contrast,
    has_checkers,
    refine_crossings,
)
from aoicell.targets.sighting import Sighting, complete, opencv_frame
from aoicell.transforms import SE3, Array

_ROUGH = EdgeWindow(arms=((-0.4, -0.15), (0.15, 0.4)), profiles=8)
_FINE = EdgeWindow()
_STILL_PX = 0.1  # moved less than that, a corner has arrived


@dataclass(frozen=True)
class Chessboard:
    """A chessboard of `columns` x `rows` inner corners and squares of `square` metres."""

    columns: int
    rows: int
    square: float
    margin: float = 0.0

    def __post_init__(self) -> None:
        if self.columns == self.rows and self.columns % 2 == 0:
            raise InputError(
                f"chessboard: {self.columns}x{self.rows} inner corners look the same after a "
                "quarter turn; use a board with unequal or odd numbers of corners"
            )

    @property
    def points(self) -> Array:
        """The inner corners, as `corners`."""
        return self.corners

    @property
    def half_turns(self) -> bool:
        """Whether a half turn changes nothing."""
        return (self.columns + self.rows) % 2 == 0

    @property
    def T_target_opencv(self) -> SE3:
        """OpenCV's frame: origin at the first corner, x right, y down, z into the print."""
        x, y, _ = self.corners[0]
        return opencv_frame(x, y)

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

    def sight(self, grey: Image, name: str = "chessboard") -> Sighting:
        """All inner corners; see `detect`."""
        return complete(self.detect(grey, name))

    def detect(self, grey: Image, name: str = "chessboard") -> Array:
        """Inner corners (N, 2) in px, in the order of `corners` up to a half turn.

        Raises TargetNotFound when a corner, or half of an outer square, is not in the picture.
        """
        uv = next(
            (uv for c in self._coarse(grey) if (uv := self._refine(grey, c)) is not None), None
        )
        if uv is None:
            raise TargetNotFound(
                f"{name}: no chessboard of {self.columns}x{self.rows} inner corners in the "
                f"{grey.shape[1]}x{grey.shape[0]} picture; bring all of it into view, in focus"
            )
        reach = 0.5 * np.max([np.linalg.norm(step, axis=1).max() for step in self.steps(uv)])
        if (uv < reach).any() or (uv > np.array(grey.shape[::-1]) - 1 - reach).any():
            raise TargetNotFound(
                f"{name}: the outer squares are cut off by the edge of the picture; "
                "bring all of the board into view"
            )
        return uv

    def detect_pair(self, grey: Image, name: str = "chessboards") -> tuple[Array, Array]:
        """Corners of two boards of this layout in one picture, larger image first."""
        first = self.detect(grey, name)
        second = self.detect(self.hidden(grey, first), name)
        larger = self.square_px(first) >= self.square_px(second)
        return (first, second) if larger else (second, first)

    def square_px(self, uv_px: Array) -> float:
        """Side of a square of the image's mean area (px)."""
        x, y = self.steps(uv_px)
        return float(np.sqrt(np.abs(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).mean()))

    def hidden(self, grey: Image, uv_px: Array) -> Image:
        """The picture with the board at these corners painted over."""
        hull = cv2.convexHull(self._grown(uv_px).astype(np.float32)).astype(np.int32)
        return np.asarray(cv2.fillConvexPoly(grey.copy(), hull, 128), dtype=np.uint8)

    def steps(self, uv_px: Array) -> tuple[Array, Array]:
        """Local vectors (N, 2) to the next column and to the next row (px)."""
        grid = uv_px.reshape(self.rows, self.columns, 2)
        x = np.asarray(np.gradient(grid, axis=1)).reshape(-1, 2)
        return x, np.asarray(np.gradient(grid, axis=0)).reshape(-1, 2)

    def _coarse(self, grey: Image) -> Iterator[Array]:
        """What OpenCV's finders take for the board, the quick ones first.

        The contour finder takes a millisecond or two but errs at times: the caller checks. The
        other one pays where that fails, by blur or by light that is uneven.
        """
        pattern = (self.columns, self.rows)
        contours = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
        half, quarter = (_shrunk(grey, by) for by in (2, 4))
        ok, corners = cv2.findChessboardCorners(half, pattern, flags=contours)
        if ok:
            yield _enlarged(corners, 2)
        for picture, by, flags in ((quarter, 4, 0), (half, 2, 0), (grey, 1, _EXHAUSTIVE)):
            ok, corners = cv2.findChessboardCornersSB(picture, pattern, flags=flags)
            if ok:
                yield _enlarged(corners, by)

    def _refine(self, grey: Image, uv_px: Array) -> Array | None:
        """Each corner where its edges cross, in order; None where it is no corner of squares."""
        uv = self._clockwise(uv_px)
        for window in (_ROUGH, _FINE, _FINE, _FINE):
            before = uv
            uv = refine_crossings(grey, uv, *self.steps(uv), window)
            if not np.isfinite(uv).all():
                return None
            if window is _FINE and np.abs(uv - before).max() < _STILL_PX:
                break
        row, column = np.divmod(np.arange(len(uv)), self.columns)
        contrasts = checker_contrast(grey, uv, *self.steps(uv))
        if not has_checkers(contrasts, column, row).all():
            return None
        return uv if contrasts[0] > 0 else self._recoloured(uv)

    def _recoloured(self, uv_px: Array) -> Array:
        """The reading in which the second square of the second row is black, where there is one."""
        if not self.half_turns:
            return half_turn(uv_px)
        if self.columns == self.rows:
            quarter = np.rot90(uv_px.reshape(self.rows, self.columns, 2))
            return np.asarray(quarter).reshape(-1, 2)
        return uv_px

    def _clockwise(self, uv_px: Array) -> Array:
        """Seen from the front, a column step turns clockwise into a row step (y is down)."""
        x, y = self.steps(uv_px)
        if np.sum(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) > 0:
            return uv_px
        return uv_px.reshape(self.rows, self.columns, 2)[:, ::-1].reshape(-1, 2)

    def _grown(self, uv_px: Array) -> Array:
        """The corner grid's outer points pushed out to the edge of the plate (px)."""
        centre = uv_px.mean(axis=0)
        grown: Array = centre + (uv_px - centre) * (1 + 3.2 / (self.rows - 1))
        return grown


_EXHAUSTIVE = cv2.CALIB_CB_EXHAUSTIVE


def _shrunk(grey: Image, by: int) -> MatLike:
    return cv2.resize(grey, None, fx=1 / by, fy=1 / by, interpolation=cv2.INTER_AREA)


def _enlarged(corners: MatLike, by: int) -> Array:
    """Corners found in the shrunk picture; pixel centres are integers."""
    return np.asarray(corners, dtype=float).reshape(-1, 2) * by + (by - 1) / 2


def half_turn(uv_px: Array) -> Array:
    """The other reading of an even board: the same corners after a turn by 180 deg."""
    return uv_px[::-1]
