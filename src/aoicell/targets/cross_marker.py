"""The paper's artificial marker: a square that contains four crosses.

Frame of a marker: origin at its centre, x to the right and y up as one looks at the
print, z out of the print. It looks the same after a quarter turn; the caller settles
which of the four readings is meant.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from cv2.typing import MatLike

from aoicell.observation import Image
from aoicell.targets.edges import Strips, bar_offsets, fit_lines, intersections
from aoicell.transforms import Array

_SIGNS = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])  # clockwise from the top left


@dataclass(frozen=True)
class CrossMarker:
    """A square of side `size` with four crosses at `pitch`; lengths in metres.

    A cross has arms of half length `arm` and of width `stroke`; the frame line around
    the square is `border` wide.
    """

    size: float = 0.060
    pitch: float = 0.036
    arm: float = 0.009
    stroke: float = 0.00225
    border: float = 0.0015

    @property
    def crosses(self) -> Array:
        """Centres of the crosses (4, 3) in the marker's frame (m), clockwise from the top left."""
        return np.column_stack([_SIGNS * self.pitch / 2, np.zeros(4)])

    @property
    def outline(self) -> Array:
        """Corners of the square (4, 3) in the marker's frame (m), clockwise from the top left."""
        return np.column_stack([_SIGNS * self.size / 2, np.zeros(4)])

    def print_image(self, pixels: int = 640) -> Image:
        """The print as seen from the front (H, W), by exact area coverage."""
        dark = np.zeros((pixels, pixels))
        for x, y in self.crosses[:, :2]:
            dark = np.maximum(dark, self._box(pixels, x, y, self.arm, self.stroke / 2))
            dark = np.maximum(dark, self._box(pixels, x, y, self.stroke / 2, self.arm))
        inside = self.size / 2 - self.border
        dark = np.maximum(dark, 1 - self._box(pixels, 0.0, 0.0, inside, inside))
        return np.round(255 * (1 - dark)).astype(np.uint8)

    def _box(self, pixels: int, x: float, y: float, half_x: float, half_y: float) -> Array:
        """Share of each pixel that a box covers."""
        edges = np.linspace(-self.size / 2, self.size / 2, pixels + 1)
        width = self.size / pixels

        def cover(low: float, high: float) -> Array:
            overlap = np.minimum(edges[1:], high) - np.maximum(edges[:-1], low)
            return np.asarray(np.clip(overlap, 0, None) / width)

        rows, columns = cover(y - half_y, y + half_y)[::-1], cover(x - half_x, x + half_x)
        return np.asarray(np.outer(rows, columns), dtype=float)

    def detect(self, grey: Image) -> list[Array]:
        """All such markers in the picture: cross centres (4, 2) in px, clockwise each.

        Which cross comes first is arbitrary: `turned` gives the other three readings.
        """
        return [self._refine(grey, uv) for uv in _candidates(grey, self)]

    def _refine(self, grey: Image, uv_px: Array) -> Array:
        """Each centre as the crossing of the middle lines of the two bars."""
        uv = uv_px
        for _ in range(3):
            x, y = self._axes(uv)
            along_x = self._bar_lines(grey, uv, x, y)
            along_y = self._bar_lines(grey, uv, y, x)
            uv = intersections(uv, x, y, along_x, along_y)
        return uv

    def _axes(self, uv_px: Array) -> tuple[Array, Array]:
        """Image vectors (4, 2) of one metre along the marker's x and y, at each cross (px/m)."""
        H, _ = cv2.findHomography(self.crosses[:, :2], uv_px)
        xy = np.column_stack([self.crosses[:, :2], np.ones(4)])
        w = xy @ H[2]
        uv = (xy @ H[:2].T) / w[:, None]
        x, y = ((H[:2, i] - uv * H[2, i]) / w[:, None] for i in (0, 1))
        return np.asarray(x), np.asarray(y)

    def _bar_lines(
        self, grey: Image, uv_px: Array, along: Array, across: Array
    ) -> tuple[Array, Array]:
        """Middle lines of the bars along `along`; sampled about every pixel, clear of the hub."""
        scale = float(np.linalg.norm(along, axis=1).mean())
        inner, outer = 0.8 * self.stroke, self.arm - 0.3 * self.stroke
        half = 1.3 * self.stroke
        count = int(np.clip((outer - inner) * scale, 6, 60))
        u = np.linspace(-half, half, int(np.clip(4 * half * scale, 17, 65)))
        t = np.concatenate([np.linspace(-outer, -inner, count), np.linspace(inner, outer, count)])
        profiles = Strips(uv_px, along, across, t, u).sample(grey)
        return fit_lines(t, bar_offsets(profiles, u), tolerance=0.1 * self.stroke)


def turned(uv_px: Array, quarter_turns: int) -> Array:
    """Another reading of the same marker, by quarter turns."""
    return np.roll(uv_px, quarter_turns, axis=0)


def _candidates(grey: Image, marker: CrossMarker) -> list[Array]:
    """Coarse cross centres of every dark frame that contains exactly four cross-like blobs."""
    block = max(31, grey.shape[1] // 16 | 1)
    dark = cv2.adaptiveThreshold(
        grey, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, block, 15
    )
    contours, hierarchy = cv2.findContours(dark, cv2.RETR_TREE, cv2.CHAIN_APPROX_NONE)
    if hierarchy is None:
        return []
    children: dict[int, list[int]] = {}
    for index, parent in enumerate(hierarchy[0][:, 3]):
        children.setdefault(int(parent), []).append(index)
    found = []
    for index, contour in enumerate(contours):
        inside = [contours[c] for c in children.get(index, []) if len(contours[c]) > 12]
        if len(inside) < 4 or not _is_quadrilateral(contour):
            continue
        area = cv2.contourArea(contour)  # specks of dust are no crosses: they are smaller
        crosses = [blob for blob in inside if _is_cross(blob, marker, area)]
        if len(crosses) == 4:
            found.append(_clockwise(np.array([_centroid(blob) for blob in crosses])))
    return found


def _is_quadrilateral(contour: MatLike) -> bool:
    perimeter = cv2.arcLength(contour, closed=True)
    polygon = cv2.approxPolyDP(contour, 0.05 * perimeter, closed=True)
    return len(polygon) == 4 and cv2.isContourConvex(polygon)


def _is_cross(contour: MatLike, marker: CrossMarker, frame_area: float) -> bool:
    """A cross fills a known share of its convex hull, and its hull a known share of the frame."""
    hull = cv2.contourArea(cv2.convexHull(contour))
    length, stroke = 2 * marker.arm, marker.stroke
    area = stroke * (2 * length - stroke)
    expected_hull = length**2 - (length - stroke) ** 2 / 2
    share = hull / frame_area * (marker.size - 2 * marker.border) ** 2 / expected_hull
    fill = cv2.contourArea(contour) / hull * expected_hull / area if hull > 0 else 0.0
    return hull > 30 and 0.5 < share < 2.0 and 0.5 < fill < 1.5


def _centroid(contour: MatLike) -> Array:
    m = cv2.moments(contour)
    return np.array([m["m10"], m["m01"]]) / m["m00"]


def _clockwise(uv_px: Array) -> Array:
    """Four points in clockwise order as seen in the picture (y is down)."""
    arms = uv_px - uv_px.mean(axis=0)
    ordered: Array = uv_px[np.argsort(np.arctan2(arms[:, 1], arms[:, 0]))]
    return ordered
