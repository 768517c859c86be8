"""The print that the cross markers share: a square frame around four crosses.

Frame of a marker: origin at its centre, x to the right and y up as one looks at the
print, z out of the print.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.errors import InputError
from aoicell.observation import Image
from aoicell.transforms import Array

Turned = tuple[bool, bool, bool, bool]  # which crosses are diagonal, clockwise from the top left
UPRIGHT: Turned = (False, False, False, False)
GAP = 0.0015  # of white between what is printed, at least (m)

_SIGNS = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])  # clockwise from the top left
_FINER = 4  # samples of a pixel along each side, where bars run askew to the raster


@dataclass(frozen=True)
class CrossPattern:
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
        return corners_of(self.pitch)

    @property
    def outline(self) -> Array:
        """Corners of the square (4, 3) in the marker's frame (m), clockwise from the top left."""
        return corners_of(self.size)

    def drawing(self, turned: Turned, pixels: int = 640) -> Image:
        """The print as seen from the front (H, W), by area coverage."""
        dark = np.zeros((pixels, pixels))
        for (x, y), diagonal in zip(self.crosses[:, :2], turned, strict=True):
            if diagonal:
                dark = np.maximum(dark, self._diagonal_cross(pixels, x, y))
                continue
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

    def _diagonal_cross(self, pixels: int, x: float, y: float) -> Array:
        """Share of each pixel that a cross at 45 degrees covers; straight within a sample."""
        step = self.size / pixels / _FINER
        places = (np.arange(pixels * _FINER) + 0.5) * step - self.size / 2
        u, v = places - x, -places[:, None] - y
        along, across = (np.abs(u + v) / np.sqrt(2), np.abs(u - v) / np.sqrt(2))

        def bar(a: Array, b: Array) -> Array:
            long, wide = (self.arm - a) / step, (self.stroke / 2 - b) / step
            return np.asarray(np.clip(long + 0.5, 0, 1) * np.clip(wide + 0.5, 0, 1))

        fine = np.maximum(bar(along, across), bar(across, along))
        shape = (pixels, _FINER, pixels, _FINER)
        return np.asarray(fine.reshape(shape).mean(axis=(1, 3)))


def corners_of(side: float) -> Array:
    """Corners (4, 3) of a square about the origin (m), clockwise from the top left."""
    return np.column_stack([_SIGNS * side / 2, np.zeros(4)])


def least_size(pitch: float) -> float:
    """Side (m) of the smallest square around crosses at a pitch, white gaps included."""
    return pitch + 2 * (CrossPattern.arm + GAP + CrossPattern.border)


def check_room(kind: str, size: float, pitch: float) -> None:
    """Raises InputError when the crosses run into each other or into the frame."""
    least_pitch = 2 * CrossPattern.arm + GAP
    if pitch < least_pitch - 1e-9:
        raise InputError(
            f"{kind} marker: crosses at a pitch of {pitch * 1e3:g} mm run into each other; "
            f"at least {least_pitch * 1e3:g} mm are needed"
        )
    if size < least_size(pitch) - 1e-9:
        raise InputError(
            f"{kind} marker: crosses at a pitch of {pitch * 1e3:g} mm do not fit into "
            f"{size * 1e3:g} mm; the square has to be {least_size(pitch) * 1e3:g} mm at least"
        )


@dataclass(frozen=True, eq=False)
class Appearance:
    """What a camera has to see at `places` (N, 2) of the marker's frame (m), clear of all edges.

    `white` (N,) marks the white ones; `parts` give the dark of each cross, then of the frame.
    """

    places: Array
    white: NDArray[np.bool_]
    parts: tuple[NDArray[Any], ...]


@lru_cache(maxsize=64)
def appearance(pattern: CrossPattern, turned: Turned, samples: int = 96) -> Appearance:
    """Where the print is dark and white, half a line's width away from edges."""
    ink = 255 - pattern.drawing(turned, samples).astype(np.float32)
    blur = 0.25 * pattern.stroke / pattern.size * samples
    soft = cv2.GaussianBlur(ink, (0, 0), blur, borderType=cv2.BORDER_REPLICATE) / 255
    rows, columns = np.nonzero((soft < 0.05) | (soft > 0.75))
    places = np.column_stack([columns + 0.5, samples - rows - 0.5]) / samples - 0.5
    places *= pattern.size
    dark = soft[rows, columns] > 0.5
    gaps = np.linalg.norm(places[:, None] - pattern.crosses[None, :, :2], axis=2)
    part = np.where(gaps.min(axis=1) <= pattern.arm, gaps.argmin(axis=1), 4)
    return Appearance(places, ~dark, tuple(np.flatnonzero(dark & (part == k)) for k in range(5)))
