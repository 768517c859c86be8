"""From MuJoCo's perfect pinhole picture to the light on the sensor: geometry, shading, blur.

Pictures are planes (H, W) of float32 grey values here; an RGB picture is three of them.
"""

from functools import cache
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.special import ive

from aoicell.camera import Camera
from aoicell.transforms import Array

Plane = NDArray[np.float32]
PinholeSize = tuple[int, int, float]  # width, height and focal length, px

_KNOT_PX = 64  # the lens bends so little within it that a cubic spline is exact to 1e-5 px
_MARGIN_PX = 3  # what the interpolation needs on each side


class Lens:
    """Turns a centred pinhole picture into the raw picture of a camera with distortion.

    `pinhole` is the (width, height, focal_px) to render: the camera's own when it is a centred
    pinhole itself, else large enough to cover its whole field in every state of warm-up.
    `focal_drift` is the relative change of the focal length from cold (0) to warm (1).
    Where `pinhole` is settled beforehand it may be too small: its edge is then repeated.
    """

    def __init__(
        self, camera: Camera, focal_drift: float = 0.0, pinhole: PinholeSize | None = None
    ) -> None:
        self._cold, self._drift = camera, focal_drift
        self._resampler: Resampler | None = None
        self._state = np.nan
        width, height = camera.width, camera.height
        plain = Camera.pinhole(camera.focal_px, width, height)
        self._bends = bool(
            pinhole
            or focal_drift
            or camera.distortion.any()
            or not np.array_equal(camera.K, plain.K)
        )
        if self._bends:
            halves = np.max([self._half_field(warm_up) for warm_up in (0.0, 1.0)], axis=0)
            width, height = (2 * (int(np.ceil(half)) + _MARGIN_PX) for half in halves)
        self.pinhole = pinhole or (width, height, camera.focal_px)

    def camera(self, warm_up: float = 0.0) -> Camera:
        """The intrinsics in a state of warm-up: the picture grows about the principal point."""
        if not self._drift:
            return self._cold
        K = np.array(self._cold.K)
        K[:, :2] *= 1 + self._drift * warm_up
        return Camera(K, self._cold.width, self._cold.height, self._cold.distortion)

    def bend(self, plane: Plane, warm_up: float = 0.0) -> Plane:
        """The raw picture (H, W) of a pinhole picture of the size that `pinhole` asks for."""
        if not self._bends:
            return plane
        state = warm_up if self._drift else 0.0
        if self._resampler is None or state != self._state:
            self._resampler, self._state = Resampler(*self._sources(state)), state
        return self._resampler(plane)

    def _half_field(self, warm_up: float) -> Array:
        """Half the width and height (px) of the pinhole picture that the camera's edge sees."""
        u, v = (np.linspace(0, size - 1, 65) for size in (self._cold.width, self._cold.height))
        edge = np.concatenate(
            [np.column_stack([u, np.full(65, y)]) for y in (0, self._cold.height - 1)]
            + [np.column_stack([np.full(65, x), v]) for x in (0, self._cold.width - 1)]
        )
        seen: Array = np.abs(self.camera(warm_up).unproject(edge)).max(axis=0)
        return seen * self._cold.focal_px

    def _sources(self, warm_up: float) -> tuple[Array, Array]:
        """Where each raw pixel (H, W) lies in the pinhole picture: u and v (px)."""
        camera, (wide, high, focal) = self.camera(warm_up), self.pinhole
        u, along_u = _spline_basis(camera.width)
        v, along_v = _spline_basis(camera.height)
        knots = np.stack(np.meshgrid(u, v), axis=-1)
        xy = camera.unproject(knots.reshape(-1, 2)).reshape(knots.shape)
        x, y = (along_v @ xy[..., axis] @ along_u.T for axis in (0, 1))
        return x * focal + (wide - 1) / 2, y * focal + (high - 1) / 2


@cache
def _spline_basis(size: int) -> tuple[Array, Array]:
    """Knots (K,) over the pixels 0 to size - 1, and the matrix (size, K) from knots to pixels."""
    knots = np.linspace(0, size - 1, max(size // _KNOT_PX, 12) + 1)
    return knots, np.asarray(make_interp_spline(knots, np.eye(len(knots)))(np.arange(size)))


class Resampler:
    """Reads a picture at sub-pixel places without moving or blurring its edges.

    OpenCV rounds places to 1/32 px, and its cubic kernel (a = -3/4) moves edges by up to 0.05 px
    and sharpens them. Two thirds of it and one third of linear interpolation do neither: they
    make the cubic kernel with a = -1/2. The linear places take up what the cubic part leaves,
    its rounding included, and their own rounding is dithered.
    """

    CUBIC = 2 / 3

    def __init__(self, u: Array, v: Array) -> None:
        """`u` and `v` (H, W): where to read, in px of the source."""
        self._cubic = _fixed_point(u, v)
        whole, fractions = self._cubic
        t = np.arange(32) / 32
        # mean place of the cubic kernel's weights at each fraction
        place = t + (2 * t**3 - 3 * t**2 + t) / 2
        moved_u = whole[..., 0] + np.tile(place, 32)[fractions]
        moved_v = whole[..., 1] + np.repeat(place, 32)[fractions]
        dither = _tiled((_BAYER - 7.5) / (16 * 32), u.shape)
        self._linear = _fixed_point(
            (u - self.CUBIC * moved_u) / (1 - self.CUBIC) + dither,
            (v - self.CUBIC * moved_v) / (1 - self.CUBIC) + dither[::-1],
        )

    def __call__(self, plane: Plane) -> Plane:
        """The picture (H, W) that is read from the source `plane`."""
        edge = cv2.BORDER_REPLICATE
        cubic = cv2.remap(plane, *self._cubic, cv2.INTER_CUBIC, borderMode=edge)
        linear = cv2.remap(plane, *self._linear, cv2.INTER_LINEAR, borderMode=edge)
        mixed = cv2.addWeighted(cubic, self.CUBIC, linear, 1 - self.CUBIC, 0, dst=cubic)
        return cast(Plane, mixed)


_BAYER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]])


def _tiled(tile: Array, shape: tuple[int, ...]) -> Array:
    height, width = shape
    repeats = (-(-height // tile.shape[0]), -(-width // tile.shape[1]))
    return np.tile(tile, repeats)[:height, :width]


def _fixed_point(u: Array, v: Array) -> tuple[NDArray[np.int16], NDArray[np.uint16]]:
    """OpenCV's quick maps: whole pixels (H, W, 2), and 32 x that of v + fraction of u in 1/32."""
    whole, fractions = cv2.convertMaps(u.astype(np.float32), v.astype(np.float32), cv2.CV_16SC2)
    return whole.astype(np.int16, copy=False), fractions.astype(np.uint16, copy=False)


def blur(plane: Plane, sigma_px: float) -> Plane:
    """The picture under a Gaussian point spread, exact in variance however narrow it is."""
    if sigma_px == 0:
        return plane
    # the discrete Gaussian: a sampled one is too narrow below 0.6 px
    reach = int(np.ceil(4 * sigma_px + 1))
    kernel = ive(np.abs(np.arange(-reach, reach + 1)), sigma_px**2)
    kernel = (kernel / kernel.sum()).astype(np.float32)
    return cast(Plane, cv2.sepFilter2D(plane, -1, kernel, kernel, borderType=cv2.BORDER_REPLICATE))


def blur_circle_px(camera: Camera, aperture: float, focus: float, distance: float) -> float:
    """Diameter (px) of the blur circle at a distance (m); focus (m) 0: all is in focus."""
    if focus == 0:
        return 0.0
    return camera.focal_px * aperture * abs(1 / distance - 1 / focus)


def smear(plane: Plane, motion_px: tuple[float, float]) -> Plane:
    """The picture while it moved along a straight line of `motion_px` (x, y), about its middle."""
    length = float(np.hypot(*motion_px))
    if length < SHORTEST_MOTION_PX:
        return plane
    steps = max(8, int(np.ceil(8 * length)))
    along = (np.arange(steps) + 0.5) / steps - 0.5
    taps_x, taps_y = (_cubic_taps(along * component) for component in motion_px)
    kernel = (taps_y.T @ taps_x / steps).astype(np.float32)
    return cast(Plane, cv2.filter2D(plane, -1, kernel, borderType=cv2.BORDER_REPLICATE))


SHORTEST_MOTION_PX = 0.02  # what is shorter widens an edge by less than 0.006 px


def _cubic_taps(places: Array) -> Array:
    """Weights (N, taps) of whole pixels about 0 for places (N,): exact in mean and variance."""
    reach = int(np.ceil(np.abs(places).max())) + 1
    d = np.abs(np.arange(-reach, reach + 1) - places[:, None])
    near = 1.5 * d**3 - 2.5 * d**2 + 1
    far = -0.5 * d**3 + 2.5 * d**2 - 4 * d + 2
    return np.where(d < 1, near, np.where(d < 2, far, 0.0))
