"""The board seen straight from above, from the colour pictures of a scan: one colour a cell."""

from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.observation import Image
from aoicell.planning.depth import DepthImage
from aoicell.planning.heights import HeightField
from aoicell.transforms import SE3

Floats = NDArray[np.float32]

SAME = 0.0015  # a cell is what a pixel shows when their depths differ by less (m)
UNSEEN = (96, 96, 96)  # colour of what no picture shows
_OUTSIDE = -10.0  # a pixel that no picture has
_SHARPNESS = 16  # power of the cosine: a picture from straight above counts much more


def orthophoto(
    images: Iterable[DepthImage], Ts_board_camera: Iterable[SE3], heights: HeightField
) -> Image:
    """Colours (rows, columns, 3) of the raster of `heights` (frame `board`).

    The mean over the pictures that show a cell; the steeper one looks down, the more it counts.
    """
    rows, columns = heights.heights.shape
    x = heights.origin[0] + heights.cell * np.arange(columns)
    y = heights.origin[1] + heights.cell * np.arange(rows)
    points = np.dstack([*np.meshgrid(x, y), heights.heights]).astype(np.float32)
    colours = np.zeros((rows, columns, 3), np.float32)
    weights = np.full((rows, columns), 1e-9, np.float32)
    for image, T_board_camera in zip(images, Ts_board_camera, strict=True):
        _add(image, T_board_camera, points, colours, weights)
    photo: Image = np.rint(colours / weights[..., None]).astype(np.uint8)
    photo[weights < 1e-6] = UNSEEN
    return photo


def _add(
    image: DepthImage, T_board_camera: SE3, points: Floats, colours: Floats, weights: Floats
) -> None:
    """Add what a picture shows of the points (rows, columns, 3), by its weight."""
    T_camera_board, K = T_board_camera.inverse(), image.camera.K.astype(np.float32)
    p_camera = points @ T_camera_board.rotation.T.astype(np.float32)
    p_camera += T_camera_board.translation.astype(np.float32)
    z = p_camera[..., 2]
    u, v = (np.nan_to_num(p_camera[..., i] / z * K[i, i] + K[i, 2], nan=_OUTSIDE) for i in (0, 1))
    seen = cv2.remap(image.depth, u, v, cv2.INTER_NEAREST, borderValue=np.nan)
    towards = T_board_camera.translation.astype(np.float32) - points
    cosine = towards[..., 2] / np.sqrt((towards**2).sum(axis=2))
    weight = np.where(np.abs(seen - z) < SAME, cosine**_SHARPNESS, np.float32(0))
    edge = cv2.BORDER_REPLICATE
    colour = cv2.remap(image.colour, u, v, cv2.INTER_LINEAR, borderMode=edge)
    colours += colour * weight[..., None]
    weights += weight
