"""What stands in the way: the highest point over each place of a board, and rays across it.

A component list and a mesh come to the same thing here, a height field in the frame `board`. What
is under an overhang counts as filled, so that nothing is taken for visible which is not.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import BoardDesign
from aoicell.transforms import Array

Flags = NDArray[np.bool_]

CELL = 0.25e-3  # side of a cell for a component list (m): a third of the smallest part
_SHIFT = 4  # fractional bits of the polygons' corners in OpenCV's fillers
_GRAZE = 5e-5  # what a ray may dip into a neighbour's edge (m)


@dataclass(frozen=True)
class HeightField:
    """`heights` (rows, columns) in m above the board's plane; NaN where there is nothing.

    The centre of cell (0, 0) is at `origin` (x, y); columns go along x, rows along y.
    """

    heights: Array
    origin: tuple[float, float]
    cell: float

    @cached_property
    def top(self) -> float:
        """The highest point of all (m)."""
        return float(np.nanmax(self.heights, initial=-np.inf))

    def at(self, xy: Array) -> Array:
        """Heights (N,) at places (N, 2); NaN outside."""
        return _read(self.heights, self._indices(xy))

    def clear(self, points: Array, centre: Array) -> Flags:
        """Which of the points (N, 3) a camera at `centre` (3,) above them sees, (N,) bool."""
        way = centre - points
        slope = way[:, :2] / way[:, 2:]  # sideways for each metre up
        run = np.hypot(*slope.T)
        reach = np.minimum((self.top - points[:, 2]) * run, np.hypot(*way[:, :2].T))
        free: Flags = way[:, 2] > 0
        steps = np.ceil(np.maximum(reach, 0.0) / self.cell).astype(int)
        open_ = np.flatnonzero(free & (steps > 0))
        for step in range(1, int(steps.max(initial=0)) + 1):
            open_ = open_[steps[open_] >= step]
            if not len(open_):
                break
            rise = step * self.cell / run[open_]
            xy = points[open_, :2] + rise[:, None] * slope[open_]
            hit = self.at(xy) > points[open_, 2] + rise + _GRAZE
            free[open_[hit]] = False
            open_ = open_[~hit]
        return free

    def _indices(self, xy: Array) -> Array:
        return np.asarray(np.rint((xy - self.origin) / self.cell))


def _read(heights: Array, index: Array) -> Array:
    rows, columns = heights.shape
    inside: Flags = np.asarray(((index >= 0) & (index < [columns, rows])).all(axis=1))
    column, row = np.where(inside[:, None], index, 0).astype(int).T
    return np.where(inside, heights[row, column], np.nan)


def heights_of(board: BoardDesign, cell: float = CELL) -> HeightField:
    """The laminate with the boxes of its components, the lower ones first."""
    width, depth, _ = board.size
    rim = 10 * cell + 0.005  # a connector may stand out over the edge
    columns, rows = (int(np.ceil((side + 2 * rim) / cell)) for side in (width, depth))
    origin = (-(columns - 1) / 2 * cell, -(rows - 1) / 2 * cell)
    heights = np.full((rows, columns), np.nan, dtype=np.float32)

    def fill(corners: Array, height: float) -> None:
        uv = (corners - origin) / cell
        cv2.fillConvexPoly(heights, np.rint(uv * 2**_SHIFT).astype(np.int32), height, shift=_SHIFT)

    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, depth / 2]
    fill(half, 0.0)
    for component in sorted(board.components, key=lambda c: c.top):
        fill(component.footprint, component.top)
    return HeightField(heights.astype(float), origin, cell)
