"""Virtual images of a design, seen through the calibrated lens: as the standard of a view."""

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.observation import Image, Renderer, to_grey
from aoicell.transforms import SE3


def virtual_picture(
    renderer: Renderer,
    designed: Camera,
    camera: Camera,
    T_base_camera: SE3,
    T_camera_board: SE3,
) -> Image:
    """A grey picture (H, W) of the board as `camera` would take it.

    The renderer draws with the `designed` camera; its picture is carried over to the calibrated
    one, whose corners it may leave black.
    """
    drawn = to_grey(renderer.render(T_base_camera, T_base_camera * T_camera_board))
    v, u = np.mgrid[: camera.height, : camera.width]
    rays = camera.unproject(np.column_stack([u.ravel(), v.ravel()]))
    uv = rays @ designed.K[:2, :2].T + designed.K[:2, 2]
    u_map, v_map = (
        uv[:, k].reshape(camera.height, camera.width).astype(np.float32) for k in (0, 1)
    )
    image = cv2.remap(drawn, u_map, v_map, cv2.INTER_LINEAR)
    return np.asarray(image, np.uint8)
