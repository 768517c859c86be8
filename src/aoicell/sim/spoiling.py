"""What spoils single pictures on their way to the sensor: a lamp's image, motion, defocus."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from aoicell.observation import Image
from aoicell.sim.optics import Plane, blur, smear
from aoicell.transforms import SE3, Array


class Spoil(Protocol):
    """Changes a pinhole picture (H, W, 3) of a camera at T_base_camera, focal length in px."""

    def __call__(self, image: Image, T_base_camera: SE3, focal_px: float) -> Image:
        """The picture as it gets to the lens."""


@dataclass(frozen=True)
class Reflection:
    """A lamp's image at a point in base (m): a bright spot that saturates.

    `radius` (m) is one standard deviation of the spot, `peak` its grey value.
    """

    p_base: Array
    radius: float
    peak: float

    def __call__(self, image: Image, T_base_camera: SE3, focal_px: float) -> Image:
        """See `Spoil`."""
        height, width = image.shape[:2]
        x, y, z = T_base_camera.actInv(self.p_base)
        u, v = focal_px * x / z + (width - 1) / 2, focal_px * y / z + (height - 1) / 2
        sigma = focal_px * self.radius / z
        across = np.exp(-(((np.arange(width) - u) / sigma) ** 2) / 2)
        down = np.exp(-(((np.arange(height) - v) / sigma) ** 2) / 2)
        light = image + (self.peak * np.outer(down, across))[:, :, None]
        return np.clip(light, 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class Blur:
    """A picture that moved by `motion_px` (x, y) during the exposure, and is out of focus by a
    point spread of `sigma_px`.
    """

    motion_px: tuple[float, float] = (0.0, 0.0)
    sigma_px: float = 0.0

    def __call__(self, image: Image, T_base_camera: SE3, focal_px: float) -> Image:
        """See `Spoil`."""
        planes = [self._blurred(image[:, :, k].astype(np.float32)) for k in range(3)]
        return np.rint(np.clip(np.dstack(planes), 0, 255)).astype(np.uint8)

    def _blurred(self, plane: Plane) -> Plane:
        return smear(blur(plane, self.sigma_px), self.motion_px)
