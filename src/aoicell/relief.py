"""What a picture of the taught board shows where: the height under every pixel, from the CAD."""

from dataclasses import dataclass

import cv2
import numpy as np

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.transforms import SE3, Array, apply

_SHIFT = 4  # fractional bits of the polygons' corners in OpenCV's fillers


@dataclass(frozen=True)
class Relief:
    """The board as a camera sees it at a pose: `heights` (H, W) over the laminate (m), NaN where
    there is no board or where a marker (with a margin) lies.
    """

    heights: Array
    camera: Camera
    T_camera_board: SE3

    def points(self, uv_px: Array) -> Array:
        """Points (..., 3) in the board's frame that pixels (..., 2) of this picture show.

        NaN where the pixel shows none. A pixel takes the height of the raster point next to it.
        """
        uv = np.asarray(uv_px, dtype=float)
        column, row = np.rint(uv[..., 0]).astype(int), np.rint(uv[..., 1]).astype(int)
        origin, rays = self.rays(uv)
        reach = (self.heights[row, column] - origin[2]) / rays[..., 2]
        return np.asarray(origin + reach[..., None] * rays)

    def rays(self, uv_px: Array) -> tuple[Array, Array]:
        """The camera's centre (3,) and the directions (..., 3) of pixels, in the board's frame."""
        xy = self.camera.unproject(uv_px.reshape(-1, 2))
        T = self.T_camera_board.inverse()
        rays = np.column_stack([xy, np.ones(len(xy))]) @ T.rotation.T
        return T.translation, rays.reshape(*uv_px.shape[:-1], 3)


def relief_of(
    board: BoardDesign, camera: Camera, T_camera_board: SE3, marker_margin: float = 0.003
) -> Relief:
    """The board's relief as designed: laminate, and the upper sides of the components' boxes.

    Flat upper sides, drawn the lower ones first: right for a camera that looks down on the board.
    """
    heights = np.full((camera.height, camera.width), np.nan, dtype=np.float32)

    def fill(corners: Array, z: float, value: float) -> None:
        ps = np.column_stack([corners, np.full(len(corners), z)])
        uv = camera.project(apply(T_camera_board, ps))
        cv2.fillConvexPoly(heights, np.rint(uv * 2**_SHIFT).astype(np.int32), value, shift=_SHIFT)

    width, depth, _ = board.size
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, depth / 2]
    fill(half, 0.0, 0.0)
    for component in sorted(board.components, key=lambda c: c.top):
        fill(component.footprint, component.top, component.top)
    for marker in board.markers:
        fill(marker.plate(marker_margin), marker.z, np.nan)
    return Relief(heights.astype(float), camera, T_camera_board)
