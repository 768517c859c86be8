"""The virtual image of a design as the standard of a view, seen through the calibrated lens."""

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.inspection.references import Reference
from aoicell.observation import Renderer, to_grey
from aoicell.transforms import SE3


def virtual_reference(
    renderer: Renderer,
    designed: Camera,
    view: str,
    camera: Camera,
    T_base_camera: SE3,
    T_camera_board: SE3,
) -> Reference:
    """What the design looks like to `camera` from its pose, with the board where it was taught.

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
    return Reference(view, (np.asarray(image, np.uint8),), T_camera_board, camera, virtual=True)
