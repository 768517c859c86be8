"""Grids of dots, also with one large dot at the origin."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from cv2.typing import MatLike
from numpy.typing import NDArray

from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image
from aoicell.targets.lattice import order
from aoicell.targets.prints import Canvas
from aoicell.targets.sighting import Sighting, enough, opencv_frame
from aoicell.transforms import SE3, Array

_BLOCKS = (16, 6, 40)  # picture width over the window of the adaptive threshold
_NEEDED = 6
_BLUR_PX = 2.5  # how wide a blurred rim is
_LARGE = 1.4  # area of the origin dot over its neighbours', at least


@dataclass(frozen=True)
class CircleGrid:
    """`columns` x `rows` dots, `spacing` metres apart; white on black serves as well.

    `points` go row by row from the top left. With `origin_dot` the dot at the lower left is
    larger than the others; without one a grid looks the same after a half turn. `asymmetric`:
    OpenCV's staggered grid, `spacing` between rows, 2 * spacing between the `columns` dots of a
    row, every second row moved right by `spacing`. Dot diameters (`dot`, `large_dot`, in
    spacings) are for the print alone: the detection takes what it sees.

    Frame: origin at the middle of the grid, x right, y up as one looks at the print, z out of
    it. OpenCV's has its origin at the first dot, x right, y down, z into the print:
    `T_target_opencv`. ROS-Industrial's grids with a large dot have theirs in it, axes as ours.

    A dot's image is measured by the centroid of its darkness. Under perspective that is not the
    image of its centre: for a dot of radius r at a distance Z, seen at an angle a from its
    normal, it lies about f (r / Z)^2 sin(a) cos(a) px off, 0.03 px for r / Z = 0.01, f = 900 px
    and 20 degrees. It is the camera that could correct this, so nothing here does.
    """

    columns: int
    rows: int
    spacing: float
    origin_dot: bool = False
    asymmetric: bool = False
    dot: float = 0.4
    large_dot: float = 0.75

    def __post_init__(self) -> None:
        if self.asymmetric and self.origin_dot:
            raise InputError("circle_grid: a staggered grid needs no origin dot; give one of both")
        if self.columns == self.rows and not (self.origin_dot or self.asymmetric):
            raise InputError(
                f"circle_grid: {self.columns}x{self.rows} equal dots look the same after a quarter "
                "turn; use unequal numbers or a large dot at the origin"
            )

    @cached_property
    def points(self) -> Array:
        """Centres of the dots (columns * rows, 3) in the target's frame (m)."""
        row, column = np.divmod(np.arange(self.columns * self.rows), self.columns)
        x = 2.0 * column + row % 2 if self.asymmetric else 1.0 * column
        xy = np.column_stack([x - (x.max() + x.min()) / 2, (self.rows - 1) / 2 - row])
        return np.column_stack([xy * self.spacing, np.zeros(len(xy))])

    @property
    def half_turns(self) -> bool:
        """Whether a half turn changes nothing."""
        return self.rows % 2 == 0 if self.asymmetric else not self.origin_dot

    @property
    def T_target_opencv(self) -> SE3:
        """OpenCV's frame: origin at the first dot, x right, y down, z into the print."""
        x, y, _ = self.points[0]
        return opencv_frame(x, y)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the print (m), a white margin of one spacing included."""
        width, height, _ = np.ptp(self.points, axis=0) + 2 * self.spacing
        return float(width), float(height)

    def print_image(self, pixels_per_metre: float = 4000.0) -> Image:
        """The print as seen from the front (H, W)."""
        canvas = Canvas(self.size, pixels_per_metre)
        for index, (x, y, _) in enumerate(self.points):
            large = self.origin_dot and index == self._origin
            canvas.disc((x, y), (self.large_dot if large else self.dot) * self.spacing)
        return canvas.image()

    def sight(self, grey: Image, name: str = "circle_grid") -> Sighting:
        """The dots of the grid, without those that the edge of the picture cuts.

        Raises TargetNotFound when not all of them are to be seen at least in part.
        """
        most = 0
        for picture in (grey, np.asarray(cv2.bitwise_not(grey), dtype=np.uint8)):
            for share in _BLOCKS:
                blobs = _blobs(picture, max(11, grey.shape[1] // share | 1))
                ordered = order(blobs[:, :2], self._pattern)
                most = max(most, ordered.grown)
                if ordered.readings:
                    chosen = blobs[self._chosen(ordered.readings, blobs[:, 2], name)]
                    return self._measured(picture, chosen, name)
        raise TargetNotFound(
            f"{name}: no grid of {self.columns}x{self.rows} dots in the {grey.shape[1]}x"
            f"{grey.shape[0]} picture, at most {most} dots in a regular order; "
            "bring all of it into view, in focus"
        )

    def _measured(self, grey: Image, blobs: Array, name: str) -> Sighting:
        """Centres of the dots (M, 6) that are whole."""
        reach = 2 * np.sqrt(blobs[:, [3, 5]]) + _BLUR_PX
        cut = (blobs[:, :2] < reach) | (blobs[:, :2] > np.array(grey.shape[::-1]) - 1 - reach)
        ids = np.flatnonzero(~cut.any(axis=1))
        seen = Sighting(ids, np.array([_centroid(grey, blobs[i]) for i in ids]).reshape(-1, 2))
        what = f"{len(ids)} of {len(blobs)} dots are whole, at least {_NEEDED} are needed"
        return enough(seen, self.points, _NEEDED, what, name)

    def _chosen(self, readings: list[NDArray[Any]], areas: Array, name: str) -> NDArray[Any]:
        """The reading whose origin is the large dot, where there is one."""
        if not self.origin_dot:
            if len(readings) > 1 + self.half_turns:
                raise TargetNotFound(
                    f"{name}: more dots than {self.columns}x{self.rows} lie in order, so the grid "
                    "can be read in several ways; check the numbers of columns and rows"
                )
            return readings[0]
        relative = [areas[r[self._origin]] / np.median(areas[r[self._beside]]) for r in readings]
        if sum(ratio > _LARGE for ratio in relative) != 1:
            raise TargetNotFound(
                f"{name}: a grid of {self.columns}x{self.rows} dots, but none at its lower left "
                "corner is larger than its neighbours; check where the large dot is and which "
                "way columns and rows go"
            )
        return readings[int(np.argmax(relative))]

    @property
    def _origin(self) -> int:
        """Index of the lower left dot."""
        return (self.rows - 1) * self.columns

    @property
    def _beside(self) -> list[int]:
        """Indices of the dots next to it."""
        return [self._origin + 1, self._origin - self.columns, self._origin - self.columns + 1]

    @property
    def _pattern(self) -> NDArray[Any]:
        """Whole coordinates (M, 2) of the dots in a basis of their lattice, y down."""
        row, column = np.divmod(np.arange(self.columns * self.rows), self.columns)
        # staggered: a step down is half a step right, so whole steps fall behind by row // 2
        return np.column_stack([column - row // 2 if self.asymmetric else column, row])


def _blobs(grey: Image, block: int) -> Array:
    """Dark ellipses (N, 6): centre, area, and the second moments xx, xy, yy (px).

    An outline is an ellipse when its area is what its second moments make of one (a square has
    0.955 of that).
    """
    dark = cv2.adaptiveThreshold(
        grey, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, block, 10
    )
    contours, levels = cv2.findContours(dark, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if levels is None:
        return np.empty((0, 6))
    outer = [c for c, parent in zip(contours, levels[0][:, 3], strict=True) if parent < 0]
    found = [blob for contour in outer if len(contour) > 9 and (blob := _ellipse(contour))]
    if not found:
        return np.empty((0, 6))
    return _alone(np.array(sorted(found, key=lambda blob: blob[2])))


def _ellipse(contour: MatLike) -> tuple[float, ...] | None:
    m = cv2.moments(contour)
    area = m["m00"]
    if area < 15:
        return None
    xx, xy, yy = m["mu20"] / area, m["mu11"] / area, m["mu02"] / area
    roundness = area / (4 * np.pi * np.sqrt(max(xx * yy - xy**2, 1e-9)))
    slender = np.hypot(xx - yy, 2 * xy) / (xx + yy)  # 0.8: axes as 3 to 1
    if roundness < 0.96 or slender > 0.8:
        return None
    return m["m10"] / area, m["m01"] / area, area, xx, xy, yy


def _alone(blobs: Array) -> Array:
    """Without blobs that have others inside: a sheet of dots. Smaller ones (N, 6) come first."""
    alone = [
        blob
        for index, blob in enumerate(blobs)
        if not (_radius(blob, blobs[:index, :2] - blob[:2]) < 1).any()
    ]
    return np.array(alone)


def _radius(blob: Array, offsets: Array) -> Array:
    """Distances (...) from a blob's centre, in its radii, of offsets (..., 2) px."""
    _, _, _, xx, xy, yy = blob
    inverse = np.linalg.inv([[xx, xy], [xy, yy]])
    return np.asarray(np.sqrt(np.einsum("...i,ij,...j->...", offsets, inverse, offsets)) / 2)


def _centroid(grey: Image, blob: Array) -> Array:
    """Centroid of a dot's darkness over its surroundings: what blur does not move."""
    u, v, _, xx, xy, yy = blob
    reach = np.ceil(np.array([1.5, 1.5]) * 2 * np.sqrt([xx, yy]) + 3).astype(int)
    low = np.maximum(np.round([u, v]).astype(int) - reach, 0)
    high = np.minimum(np.round([u, v]).astype(int) + reach + 1, grey.shape[::-1])
    x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    patch = grey[low[1] : high[1], low[0] : high[0]].astype(float)
    d = np.stack([x - u, y - v], axis=-1)
    # in radii of the dot, its blurred rim left out of the surroundings
    radius = _radius(blob, d)
    rim = _BLUR_PX / np.sqrt(np.sqrt(xx * yy - xy**2)) / 2
    around = (radius > 1 + rim) & (radius < 1.4 + rim)
    background = np.median(patch[around]) if around.any() else patch.max()
    weight = np.where(radius < 1 + rim, np.clip(background - patch, 0, None), 0)
    centre: Array = np.array([u, v]) + (weight[..., None] * d).sum(axis=(0, 1)) / weight.sum()
    return centre
