"""Virtual images of a design, seen through the calibrated lens: as the standard of a view."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.camera import Camera
from aoicell.observation import Image, Renderer, SolidRenderer, to_grey
from aoicell.transforms import SE3

BEYOND = -3  # in place of a component's number, where nothing was drawn


@dataclass(frozen=True, eq=False)
class Drawing:
    """A design as drawn for a view. `designed`, `turned` and `bare` are grey pictures (H, W) of the
    board as it should be, with each component turned by half, and with nothing on it; `numbers`
    (H, W): which component in the board's list is seen there, -1 for anything else, `BEYOND` where
    the drawing ends; `heights` (H, W): that surface over the laminate (m).
    """

    designed: Image
    turned: Image
    bare: Image
    numbers: NDArray[np.int16]
    heights: NDArray[np.float32]


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
    return np.asarray(cv2.remap(drawn, *_carried(designed, camera), cv2.INTER_LINEAR), np.uint8)


def drawing(
    renderer: SolidRenderer,
    designed: Camera,
    camera: Camera,
    T_base_camera: SE3,
    T_camera_board: SE3,
) -> Drawing:
    """What such a picture shows, and what it would show of a board put together otherwise."""
    poses = T_base_camera, T_base_camera * T_camera_board
    numbers, depths = renderer.solids(*poses)
    v, u = np.mgrid[: designed.height, : designed.width]
    pixels = np.stack([u, v, np.ones_like(u)], axis=-1)
    upwards = T_camera_board.rotation[:, 2]  # the board's z in the camera's frame
    rise = pixels @ (np.linalg.inv(designed.K).T @ upwards)
    heights = (depths * rise - upwards @ T_camera_board.translation).astype(np.float32)
    maps = _carried(designed, camera)

    def seen(picture: Image) -> Image:
        replicated = cv2.BORDER_REPLICATE
        carried = cv2.remap(to_grey(picture), *maps, cv2.INTER_LINEAR, borderMode=replicated)
        return np.asarray(carried, np.uint8)

    return Drawing(
        seen(renderer.render(*poses)),
        seen(renderer.half_turned(*poses)),
        seen(renderer.bare(*poses)),
        np.asarray(cv2.remap(numbers, *maps, cv2.INTER_NEAREST, borderValue=(BEYOND,)), np.int16),
        np.asarray(cv2.remap(heights, *maps, cv2.INTER_NEAREST), np.float32),
    )


def _carried(designed: Camera, camera: Camera) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """For each pixel of the calibrated camera, column and row (H, W) in the designed one's."""
    v, u = np.mgrid[: camera.height, : camera.width]
    rays = camera.unproject(np.column_stack([u.ravel(), v.ravel()]))
    uv = (rays @ designed.K[:2, :2].T + designed.K[:2, 2]).astype(np.float32)
    shape = (camera.height, camera.width)
    return uv[:, 0].reshape(shape), uv[:, 1].reshape(shape)
