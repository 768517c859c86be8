"""The new picture as the reference's camera would have taken it: resampled, tall parts and all.

How far a pixel moves changes smoothly over the picture and grows evenly with the height of what it
shows: two planes, one on the laminate and one above all parts, are mapped at a few nodes and
interpolated by polynomials.
"""

from functools import cache

import cv2
import numpy as np
from numpy.polynomial.chebyshev import chebpts1, chebvander

from aoicell.camera import Camera
from aoicell.inspection.planes import Plane
from aoicell.inspection.registration import FineRegistration
from aoicell.inspection.sampling import sampled
from aoicell.inspection.shown import Shown
from aoicell.observation import Image
from aoicell.transforms import SE3, Array

_NODES = 7  # along either side: exact to 0.01 px for lenses and motions as they occur
_STEP_PX = 16  # linear between these is exact to as much
_LEAST_PARALLAX_PX = 0.05  # less is not worth the time


class Warp:
    """From pictures of one view to its reference's pixels; made once for a reference."""

    def __init__(self, camera: Camera, T_camera_board: SE3, shown: Shown) -> None:
        self._shape = (camera.height, camera.width)
        u, v = (_at_nodes(size) for size in (camera.width, camera.height))
        self._uv = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
        self._heights = shown.heights
        self._ceiling = max(float(shown.heights.max()), 1e-3)
        self._floor = on_plane(self._uv, 0.0, camera, T_camera_board)
        self._roof = on_plane(self._uv, self._ceiling, camera, T_camera_board)

    def __call__(self, new: Image, registration: FineRegistration) -> Plane:
        """The new picture (H, W) in the reference's pixels, NaN where it does not reach."""
        low, high = (
            (registration.project(points) - self._uv).astype(np.float32).reshape(_NODES, _NODES, 2)
            for points in (self._floor, self._roof)
        )
        parallax = high - low
        maps = []
        for axis, pixels in enumerate(_pixels(*self._shape)):
            flow = self._spread(low[..., axis])
            if np.abs(parallax).max() > _LEAST_PARALLAX_PX:
                rise = self._spread(parallax[..., axis] / np.float32(self._ceiling))
                flow += rise * self._heights
            maps.append(flow + pixels)
        columns, rows = maps
        return sampled(new.astype(np.float32), columns, rows, beyond=np.nan)

    def _spread(self, nodes: Plane) -> Plane:
        """Values (H, W) from those at the nodes: by polynomials to a grid, linear between."""
        height, width = self._shape
        grid = np.asarray(_basis(height) @ nodes @ _basis(width).T, np.float32)
        finer = cv2.resize(grid, None, fx=_STEP_PX, fy=_STEP_PX, interpolation=cv2.INTER_LINEAR)
        inner = (slice(_STEP_PX, _STEP_PX + height), slice(_STEP_PX, _STEP_PX + width))
        return np.asarray(finer[inner], np.float32)


def on_plane(uv_px: Array, z: float, camera: Camera, T_camera_board: SE3) -> Array:
    """Points (N, 3) of the board's plane at a height z (m) that pixels (N, 2) look at."""
    T = T_camera_board.inverse()
    xy = camera.unproject(uv_px)
    rays = np.column_stack([xy, np.ones(len(xy))]) @ T.rotation.T
    reach = (z - T.translation[2]) / rays[:, 2]
    return np.asarray(T.translation + reach[:, None] * rays)


def _at_nodes(size: int) -> Array:
    return np.asarray((chebpts1(_NODES) + 1) / 2 * (size - 1))


@cache
def _basis(size: int) -> Plane:
    """From values at the nodes to those at the middles of every so many pixels, (steps, nodes),
    one step more at either end.
    """
    fit = np.linalg.inv(chebvander(chebpts1(_NODES), _NODES - 1))
    pixels = _STEP_PX * (np.arange(-(-size // _STEP_PX) + 2) - 0.5) - 0.5
    return np.asarray(chebvander(2 * pixels / (size - 1) - 1, _NODES - 1) @ fit, np.float32)


@cache
def _pixels(height: int, width: int) -> tuple[Plane, Plane]:
    """Column and row of each pixel, to be added to a flow."""
    return np.arange(width, dtype=np.float32)[None], np.arange(height, dtype=np.float32)[:, None]
