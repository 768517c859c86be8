"""Pictures of printed targets, by exact area coverage: what is wanted of a print, not of a camera.

A pixel's value is the share of it that stays white, so edges stand where they should however
coarse the picture is.
"""

import numpy as np

from aoicell.observation import Image
from aoicell.transforms import Array


class Canvas:
    """A white sheet of width x height (m) to paint on, origin at its centre, y up."""

    def __init__(self, size: tuple[float, float], pixels_per_metre: float) -> None:
        width, height = (max(1, round(side * pixels_per_metre)) for side in size)
        self.x = np.linspace(-size[0] / 2, size[0] / 2, width + 1)
        self.y = np.linspace(size[1] / 2, -size[1] / 2, height + 1)
        self.dark = np.zeros((height, width))

    def cells(self, dark: Array, centre: tuple[float, float], size: tuple[float, float]) -> None:
        """A grid of cells (R, C), 1 for black, that fills a rectangle of `size` (m)."""
        rows, columns = dark.shape
        x = np.linspace(-size[0] / 2, size[0] / 2, columns + 1) + centre[0]
        y = np.linspace(size[1] / 2, -size[1] / 2, rows + 1) + centre[1]
        down, across = _touched(-self.y, -y), _touched(self.x, x)
        shares_down = _shares(-self.y[down.start : down.stop + 1], -y)
        shares_across = _shares(self.x[across.start : across.stop + 1], x)
        self.dark[down, across] += shares_down @ dark @ shares_across.T

    def disc(self, centre: tuple[float, float], diameter: float) -> None:
        """A black disc; its rim is straight within a pixel."""
        half = diameter / 2 + (self.x[1] - self.x[0])
        across = _touched(self.x, np.array([centre[0] - half, centre[0] + half]))
        down = _touched(-self.y, np.array([-centre[1] - half, -centre[1] + half]))
        x, y = ((edges[1:] + edges[:-1]) / 2 for edges in (self.x, self.y))
        distance = np.hypot(x[across] - centre[0], y[down, None] - centre[1])
        share = np.clip((diameter / 2 - distance) / (self.x[1] - self.x[0]) + 0.5, 0, 1)
        self.dark[down, across] += share

    def image(self) -> Image:
        """The sheet as grey values (H, W)."""
        return np.round(255 * (1 - np.clip(self.dark, 0, 1))).astype(np.uint8)


def _touched(pixels: Array, cells: Array) -> slice:
    """The pixels that a row of cells reaches; both given by rising edges."""
    first = max(int(np.searchsorted(pixels, cells[0], side="right")) - 1, 0)
    return slice(first, min(int(np.searchsorted(pixels, cells[-1])), len(pixels) - 1))


def _shares(pixels: Array, cells: Array) -> Array:
    """Share of each pixel (N,) that each cell (M,) covers; both given by rising edges."""
    high = np.minimum(pixels[1:, None], cells[None, 1:])
    low = np.maximum(pixels[:-1, None], cells[None, :-1])
    return np.asarray(np.clip(high - low, 0, None) / np.diff(pixels)[:, None])
