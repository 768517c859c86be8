"""What stands on a scanned board: each bump with its place, its size and its height.

Cells that are higher than the noise and touch each other are one bump, unless it falls apart when
it is cut higher up and the ground between its parts is low: then these are bumps of their own
(modules in a row of slots), while the fins of a heat sink on their common base stay one. Ground
that no picture showed counts as filled in narrow gaps between thin things.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.planning.heights import HeightField
from aoicell.transforms import Array

Mask = NDArray[np.bool_]

_RAGGED = np.ones((3, 3), np.uint8)
_DEEPEST = 0.002  # under the board's surface: what lies deeper is the edge or the table (m)
_CUTS = 24  # heights at which a bump is cut to see whether it falls apart


@dataclass(frozen=True)
class BumpConfig:
    """`least_height` (m), and in `sigmas` of the surface's noise; `least_area` (m^2).

    `narrow` (m): the widest unseen gap between things thinner than that (fins) that is taken for
    filled; `low`: the ground between two bumps is at most this share of their height; `part_width`
    (m): the least of what is a bump of its own when a larger one falls apart; `highest_cut`: as a
    share of its top; `unseen`: the share of a splinter's surroundings that no picture showed.
    """

    least_height: float = 0.00025
    sigmas: float = 5.0
    least_area: float = 0.6e-6
    narrow: float = 0.004
    low: float = 0.3
    part_width: float = 0.00125
    highest_cut: float = 0.7
    unseen: float = 0.3


@dataclass(frozen=True)
class Bump:
    """A target: `x, y` of its middle in the board's plane (m), turn of its long side (rad, from
    -pi/2 to pi/2), `width` along that and `depth` across (m), `height` of its top (m).
    """

    x: float
    y: float
    rotation: float
    width: float
    depth: float
    height: float


def find_bumps(
    heights: HeightField, size: tuple[float, float], config: BumpConfig | None = None
) -> list[Bump]:
    """The bumps on a board of that size (m), the highest first.

    `heights` are those over the board's surface, in its frame.
    """
    config = config or BumpConfig()
    return sorted(
        (_measured(heights, patch, config) for patch in _patches(heights, size, config)),
        key=lambda bump: -bump.height,
    )


def least_height(heights: HeightField, config: BumpConfig) -> float:
    """What a bump has to be higher than (m): nothing but noise lies under the board's surface."""
    z = heights.heights
    under = z[(z < 0) & (z > -_DEEPEST)]
    sigma = 1.4826 * float(np.median(-under)) if len(under) else 0.0
    return max(config.least_height, config.sigmas * sigma)


@dataclass(frozen=True)
class _Patch:
    """A piece of the raster, from (row, column) on, and the cells in it that belong to a bump."""

    row: int
    column: int
    mask: Mask

    @property
    def window(self) -> tuple[slice, slice]:
        """The piece's rows and columns in the raster."""
        rows, columns = self.mask.shape
        return np.s_[self.row : self.row + rows, self.column : self.column + columns]

    def of(self, values: Array) -> Array:
        """That piece of another raster."""
        return values[self.window]


def _patches(
    heights: HeightField, size: tuple[float, float], config: BumpConfig
) -> Iterator[_Patch]:
    z = heights.heights
    rows, columns = z.shape
    x = np.abs(heights.origin[0] + heights.cell * np.arange(columns)) <= size[0] / 2
    y = np.abs(heights.origin[1] + heights.cell * np.arange(rows)) <= size[1] / 2
    board: Mask = y[:, None] & x
    whole = _Patch(0, 0, np.ones(z.shape, bool))
    floor = least_height(heights, config)
    for part in _parts(heights, whole, floor, config):
        on_board = (part.mask & board[part.window]).any()
        if on_board and not _fragment(heights, part, config):
            yield from _split(heights, part, floor, config)


def _split(
    heights: HeightField, patch: _Patch, level: float, config: BumpConfig
) -> Iterator[_Patch]:
    """The bump itself, or those that it falls apart into when it is cut above `level`."""
    z = patch.of(heights.heights)
    top = np.nanpercentile(np.where(patch.mask, z, np.nan), 95)
    for cut in np.geomspace(level, max(config.highest_cut * top, level), _CUTS)[1:]:
        parts = [
            part
            for part in _parts(heights, patch, cut, config)
            if _wide(part.mask, config.part_width / heights.cell)
        ]
        if len(parts) >= 2 and _ground(heights, patch, parts) <= config.low * _lowest(
            heights, parts
        ):
            for part in parts:
                yield from _split(heights, part, cut, config)
            return
    yield patch


def _parts(
    heights: HeightField, patch: _Patch, level: float, config: BumpConfig
) -> Iterator[_Patch]:
    """Connected pieces of what is higher than `level` in a patch."""
    z = patch.of(heights.heights)
    high = (patch.mask & (z > level)).astype(np.uint8)  # false for NaN
    filled = high | _between_thin(high, z, round(config.narrow / heights.cell / 2))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(filled, connectivity=4)
    for label in range(1, count):
        left, up, columns, rows, area = stats[label]
        if area * heights.cell**2 >= config.least_area:
            mask = labels[up : up + rows, left : left + columns] == label
            if np.isfinite(z[up : up + rows, left : left + columns][mask]).any():
                yield _Patch(patch.row + up, patch.column + left, mask)


def _fragment(heights: HeightField, patch: _Patch, config: BumpConfig) -> bool:
    """Whether it is a splinter of something that was not seen whole: small, amid the unseen."""
    if _wide(patch.mask, config.part_width / heights.cell):
        return False
    row, column = max(patch.row - 1, 0), max(patch.column - 1, 0)
    rows, columns = (size + 1 for size in patch.mask.shape)
    window = np.s_[row : patch.row + rows, column : patch.column + columns]
    mask = np.zeros(heights.heights.shape, np.uint8)[window]
    top, left = patch.row - row, patch.column - column
    mask[top : top + rows - 1, left : left + columns - 1] = patch.mask
    ring = (cv2.dilate(mask, _RAGGED) > 0) & (mask == 0)
    return bool(np.isnan(heights.heights[window][ring]).mean() > config.unseen)


def _wide(mask: Mask, cells: float) -> bool:
    """Whether a square of so many cells fits in: the ragged foot of a wall is no bump."""
    side = max(1, round(cells))
    padded = np.pad(mask, 1).astype(np.uint8)  # outside of it is nothing
    return bool(cv2.erode(padded, np.ones((side, side), np.uint8)).any())


def _between_thin(high: NDArray[np.uint8], z: Array, half: int) -> NDArray[np.uint8]:
    """Unseen cells in gaps of up to twice `half` cells between things thinner than that."""
    kernel = np.ones((2 * half + 1, 2 * half + 1), np.uint8)
    padded = np.pad(high, 2 * half + 1)  # to OpenCV what lies outside is as high as can be
    slender = padded - cv2.morphologyEx(padded, cv2.MORPH_OPEN, kernel)
    thin = cv2.morphologyEx(slender, cv2.MORPH_OPEN, _RAGGED)  # without the rims of thick things
    closed = cv2.morphologyEx(thin, cv2.MORPH_CLOSE, kernel)
    inner = closed[2 * half + 1 : -2 * half - 1, 2 * half + 1 : -2 * half - 1]
    return np.where(np.isnan(z), inner, 0).astype(np.uint8)


def _ground(heights: HeightField, patch: _Patch, parts: list[_Patch]) -> float:
    """The usual height of what belongs to a bump but to none of its parts."""
    rest = patch.mask.copy()
    for part in parts:
        inside = rest[part.row - patch.row :, part.column - patch.column :]
        inside[: part.mask.shape[0], : part.mask.shape[1]][part.mask] = False
    z = patch.of(heights.heights)[rest]
    z = z[np.isfinite(z)]
    return float(np.median(z)) if len(z) else 0.0


def _lowest(heights: HeightField, parts: list[_Patch]) -> float:
    return float(min(_top(heights, part) for part in parts))


def _top(heights: HeightField, patch: _Patch) -> float:
    return float(np.nanpercentile(patch.of(heights.heights)[patch.mask], 98))


def _measured(heights: HeightField, patch: _Patch, config: BumpConfig) -> Bump:
    """A bump by the rectangle around what is above half its height."""
    z, top = patch.of(heights.heights), _top(heights, patch)
    body = patch.mask & (z > top / 2)
    rows, columns = np.nonzero(body if body.any() else patch.mask)
    cells = np.column_stack([columns + patch.column, rows + patch.row]).astype(np.float32)
    (u, v), (a, b), turn = cv2.minAreaRect(cells)
    if a < b:
        a, b, turn = b, a, turn + 90
    turn = (turn + 90) % 180 - 90
    x, y = np.array(heights.origin) + heights.cell * np.array([u, v])
    width, depth = (heights.cell * (side + 1) for side in (a, b))  # from middle to middle of cells
    return Bump(float(x), float(y), float(np.radians(turn)), width, depth, top)
