"""From the light that passed the lens to grey values.

The order is that of nature: the lens bends the picture, exposure and uneven light scale it,
point spread, defocus and motion blur it, and the sensor adds shot and read noise and counts.
Level, colour and direction of the lamps belong to the scene: the render already shows them.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import cast

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.observation import Image, to_grey
from aoicell.sim.as_built import Light, Sensor
from aoicell.sim.optics import Lens, PinholeSize, Plane, blur, blur_circle_px, smear


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

    def __init__(
        self, camera: Camera, sensor: Sensor, light: Light, pinhole: PinholeSize | None = None
    ) -> None:
        """`pinhole`: what is rendered, where that is settled."""
        self._camera, self._sensor, self._lighting = camera, sensor, light
        self._lens = Lens(camera, sensor.focal_drift, pinhole)

    @cached_property
    def _shading(self) -> Plane | None:  # takes a tenth of a second; not every cell takes pictures
        return shading(self._camera, self._sensor, self._lighting)

    @property
    def pinhole(self) -> PinholeSize:
        """Width, height and focal length (px) of the render that `expose` wants."""
        return self._lens.pinhole

    def camera(self, warm_up: float = 0.0) -> Camera:
        """The true intrinsics at a state of warm-up."""
        return self._lens.camera(warm_up)

    def expose(self, pinhole_rgb: Image, at: Conditions, rng: np.random.Generator) -> Image:
        """The raw picture, grey (H, W) or RGB (H, W, 3), of a pinhole render (h, w, 3).

        Each source draws from a child of `rng` of its own, in the order flicker, shot, read: a
        source that is switched on or off changes no other's draw. A new one goes at the end.
        """
        flicker, shot, read = rng.spawn(3)
        level = max(1 + self._lighting.flicker * flicker.standard_normal(), 0.0)
        planes = np.moveaxis(pinhole_rgb, 2, 0) if at.colour else [to_grey(pinhole_rgb)]
        raw = [self._read_out(self._light(p, at, level), shot, read) for p in planes]
        return np.dstack(raw) if at.colour else raw[0]

    def _light(self, grey: Image, at: Conditions, level: float) -> Plane:
        """The light on the sensor (H, W), in grey values."""
        plane = self._lens.bend(grey.astype(np.float32), at.warm_up)
        if self._shading is not None:
            plane = cast(Plane, cv2.multiply(plane, self._shading, scale=level))
        elif level != 1:
            plane = plane * np.float32(level)
        s = self._sensor
        circle = blur_circle_px(self.camera(at.warm_up), s.aperture, s.focus, at.distance)
        # the standard deviation of a disc along an axis is a quarter of its diameter
        return smear(blur(plane, float(np.hypot(s.psf_px, circle / 4))), at.motion_px)

    def _read_out(
        self, light: Plane, shot: np.random.Generator, read: np.random.Generator
    ) -> Image:
        """Grey values of the light, with noise."""
        s = self._sensor
        noisy = add_read_noise(add_shot_noise(light, s.gain, shot), s.noise_grey, read)
        return digitise(noisy, s.adc_bits)


def shading(camera: Camera, sensor: Sensor, light: Light) -> Plane | None:
    """Brightness (H, W) over the picture as a factor, None where it is 1 everywhere.

    Vignetting falls with the square of the distance from the optical axis, to its full loss at
    half the picture's diagonal; the gradient is linear, to its full size at the picture's edges.
    """
    if not (sensor.vignetting or any(light.gradient) or sensor.brightness != 1):
        return None
    width, height = camera.width, camera.height
    cx, cy = (width - 1) / 2, (height - 1) / 2
    u, v = np.arange(width), np.arange(height)[:, None]
    axis_u, axis_v = camera.K[:2, 2]
    r2 = ((u - axis_u) ** 2 + (v - axis_v) ** 2) / (cx**2 + cy**2)
    fall = 1 + light.gradient[0] * (u - cx) / cx + light.gradient[1] * (v - cy) / cy
    factor = sensor.brightness * np.maximum(1 - sensor.vignetting * r2, 0) * np.maximum(fall, 0)
    return np.asarray(factor, dtype=np.float32)


def add_shot_noise(light: Plane, gain: float, rng: np.random.Generator) -> Plane:
    """Light with noise of variance grey value / `gain` (electrons a grey value; 0: none)."""
    if gain == 0:
        return light
    sigma = cv2.sqrt(np.maximum(light, 0))
    noise = cv2.multiply(sigma, _field(light.shape, rng), dst=sigma)
    return cast(Plane, cv2.scaleAdd(noise, gain**-0.5, light))


def add_read_noise(light: Plane, sigma_grey: float, rng: np.random.Generator) -> Plane:
    """Light with normal noise of `sigma_grey` in each pixel."""
    if sigma_grey == 0:
        return light
    return cast(Plane, cv2.scaleAdd(_field(light.shape, rng), sigma_grey, light))


def digitise(light: Plane, bits: int) -> Image:
    """Grey values of 8 bits from a converter of `bits` over the same full scale; 0: exact."""
    if bits:
        steps = (2**bits - 1) / 255
        light = np.rint(np.clip(light, 0, 255) * np.float32(steps)) / np.float32(steps)
    return np.rint(np.clip(light, 0, 255)).astype(np.uint8)


_OFFSETS = 2**20  # so many fields lie in one table, each beginning at a number of its own


def _field(shape: tuple[int, ...], rng: np.random.Generator) -> Plane:
    """Independent standard normal numbers, read from a table at a place that `rng` says.

    Drawing them anew would take as long as the whole rest. Two fields of the same table are
    uncorrelated pixel by pixel unless they begin at the same place, one case in a million.
    """
    count, start = int(np.prod(shape)), int(rng.integers(_OFFSETS))
    return _normal_table(count + _OFFSETS)[start : start + count].reshape(shape)


@cache
def _normal_table(size: int) -> Plane:
    """The table, the same on every worker, with a mean of exactly 0 and a variance of 1."""
    numbers = np.random.default_rng(4071).standard_normal(size, dtype=np.float32)
    numbers -= numbers.mean(dtype=float)
    numbers /= numbers.std(dtype=float)
    return numbers
