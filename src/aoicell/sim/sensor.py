"""From the light that passed the lens to grey values."""

from dataclasses import dataclass

import numpy as np

from aoicell.camera import Camera
from aoicell.observation import Image, to_grey
from aoicell.sim.as_built import Light, Sensor
from aoicell.sim.optics import Lens


@dataclass(frozen=True)
class Conditions:
    """What changes from picture to picture.

    `distance` (m) of the scene along the optical axis; `motion_px` (2,) how far the picture
    moves during the exposure; `warm_up` from 0 (cold) to 1 (the focal length has drifted);
    `colour` for an RGB picture instead of a grey one.
    """

    distance: float
    motion_px: tuple[float, float] = (0.0, 0.0)
    warm_up: float = 0.0
    colour: bool = False


class CameraModel:
    """One camera: turns pinhole renders into its raw pictures."""

    def __init__(self, camera: Camera, sensor: Sensor, light: Light) -> None:
        self._camera, self._sensor, self._light = camera, sensor, light
        self._lens = Lens(camera)

    @property
    def pinhole(self) -> tuple[int, int, float]:
        """Width, height and focal length (px) of the render that `expose` wants."""
        return self._lens.pinhole

    def camera(self, warm_up: float = 0.0) -> Camera:
        """The true intrinsics at a state of warm-up."""
        return self._camera

    def expose(self, pinhole_rgb: Image, at: Conditions, rng: np.random.Generator) -> Image:
        """The raw picture, grey (H, W) or RGB (H, W, 3), of a pinhole render (h, w, 3)."""
        image = pinhole_rgb if at.colour else to_grey(pinhole_rgb)
        return add_noise(self._lens.expose(image), self._sensor.noise_grey, rng)


def add_noise(image: Image, sigma_grey: float, rng: np.random.Generator) -> Image:
    """The picture with normal noise of `sigma_grey` in each value, rounded and clipped."""
    if sigma_grey == 0:
        return image
    noise = sigma_grey * rng.standard_normal(image.shape, dtype=np.float32)
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)
