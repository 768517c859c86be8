"""The paper's artificial marker: a square that contains four crosses.

It looks the same after a quarter turn; the caller settles which of the four readings is meant.
"""

from dataclasses import dataclass

import numpy as np

from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.targets.cross_fit import fit_crosses, looks_right, read_diagonals
from aoicell.targets.cross_pattern import UPRIGHT, CrossPattern, Turned, check_room
from aoicell.targets.cross_search import find_fours
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.transforms import Array


@dataclass(frozen=True)
class CrossMarker(CrossPattern):
    """The plain marker: all four crosses upright."""

    def __post_init__(self) -> None:
        check_room("cross", self.size, self.pitch)

    def print_image(self, pixels: int = 640) -> Image:
        """The print as seen from the front (H, W), by exact area coverage."""
        return self.drawing(UPRIGHT, pixels)

    def detect(self, grey: Image) -> list[Array]:
        """All such markers in the picture: cross centres (4, 2) in px, clockwise each.

        Which cross comes first is arbitrary: `turned` gives the other three readings.
        """
        return [seen.uv_px for seen in self.sight(grey)]

    def sight(self, grey: Image, camera: Camera | None = None) -> list[MarkerSighting]:
        """All such markers in the raw picture; with the camera its distortion is in the model."""
        return [
            MarkerSighting(found.uv_px, found.sigma_px)
            for found in find_markers(grey, self, camera)
            if found.turned == UPRIGHT
        ]


@dataclass(frozen=True, eq=False)
class FoundCrosses:
    """Four crosses in a square: which are diagonal, centres (4, 2) px, their sigma (4,) px."""

    turned: Turned
    uv_px: Array
    sigma_px: Array


def find_markers(
    grey: Image, pattern: CrossPattern, camera: Camera | None = None
) -> list[FoundCrosses]:
    """Every square of four crosses in a picture, whichever of them are diagonal."""
    shape = CrossPattern(pattern.size, pattern.pitch, pattern.arm, pattern.stroke, pattern.border)
    rough = find_fours(grey, shape)
    if not len(rough):
        return []
    diagonal, possible = read_diagonals(grey, shape, rough)
    rough, diagonal = rough[possible], diagonal[possible]
    if not possible.any():
        return []
    uvs, sigmas = fit_crosses(grey, shape, diagonal, rough, camera)
    found: list[FoundCrosses] = []
    for crosses, uv, sigma in zip(diagonal.tolist(), uvs, sigmas, strict=True):
        if not np.isfinite(uv).all() or any(_meet(uv, other.uv_px) for other in found):
            continue
        if looks_right(grey, shape, tuple(crosses), uv):
            found.append(FoundCrosses(tuple(crosses), uv, sigma))
    return found


def _meet(uv_px: Array, other_px: Array) -> bool:
    """Whether two squares of crosses (4, 2) px have one in common."""
    gaps = np.linalg.norm(uv_px[:, None] - other_px, axis=2)
    return bool(gaps.min() < 0.2 * np.linalg.norm(other_px[1] - other_px[0]))


def turned(uv_px: Array, quarter_turns: int) -> Array:
    """Another reading of the same marker, by quarter turns."""
    return np.roll(uv_px, quarter_turns, axis=0)
