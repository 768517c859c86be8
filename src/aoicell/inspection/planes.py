"""Grey values in every pixel of a picture, and how they change from one to the next."""

import cv2
import numpy as np
from numpy.typing import NDArray

Plane = NDArray[np.float32]


def slopes(plane: Plane) -> Plane:
    """Grey values a pixel (H, W, 2) along columns and rows."""
    along = [cv2.Sobel(plane, cv2.CV_32F, *xy, ksize=1, scale=0.5) for xy in ((1, 0), (0, 1))]
    return np.asarray(np.dstack(along), np.float32)


def steepness(plane: Plane) -> Plane:
    """Their amount (H, W)."""
    along = slopes(plane)
    return np.asarray(cv2.magnitude(along[..., 0], along[..., 1]), np.float32)
