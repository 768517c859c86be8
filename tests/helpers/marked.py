"""Pictures of markers at known poses, through a lens."""

from collections.abc import Callable

import numpy as np

from aoicell.observation import Image
from aoicell.targets.marker import Marker
from aoicell.transforms import SE3, Array
from helpers.printed import BENT, picture, seen_from


class Sheet:
    """A marker as `helpers.printed` draws it."""

    def __init__(self, marker: Marker) -> None:
        self.marker = marker
        self.size = (marker.size, marker.size)

    def print_image(self, pixels_per_metre: float) -> Image:
        return self.marker.print_image(round(self.marker.size * pixels_per_metre))


def shown(
    *markers: tuple[Marker, SE3], blur_px: float = 0.6, noise: float = 1.0, seed: int = 0,
    cover: Callable[[Image], None] | None = None,
) -> Image:  # fmt: skip
    """A picture (480, 640) of markers at their poses T_camera_marker, by the lens `BENT`."""
    sheets = [(Sheet(marker), T) for marker, T in markers]
    return picture(*sheets, blur_px=blur_px, noise=noise, seed=seed, cover=cover)  # type: ignore[arg-type]


def true_px(marker: Marker, T_camera_marker: SE3) -> Array:
    """Where the four points (4, 2) of a marker are."""
    return BENT.project(marker.crosses, T_camera_marker)


def aside(x: float, y: float, roll: float = 0.3, tilt: tuple[float, float] = (0, 0)) -> SE3:
    """T_camera_marker 0.4 m off, (x, y) (m) to the right of and below the middle of the view."""
    T = seen_from(tilt, roll, 0.4)
    return SE3(T.rotation, T.translation + np.array([x, y, 0.0]))
