"""From MuJoCo's perfect pinhole picture to what the sensor delivers."""

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.transforms import Array

_NO_MAP = np.empty(0, dtype=np.float32)  # both coordinates are in the first map


class Lens:
    """Turns a centred pinhole picture into the raw picture of a camera with distortion.

    `pinhole` is the (width, height, focal_px) to render: the camera's own when it has neither
    distortion nor a decentred principal point, else large enough to cover its whole field.
    """

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        width, height = camera.width, camera.height
        plain = Camera.pinhole(camera.focal_px, width, height)
        if np.array_equal(camera.K, plain.K) and not camera.distortion.any():
            self.pinhole, self._maps = (width, height, camera.focal_px), None
            return
        xy = camera.unproject(_pixel_grid(width, height)).astype(float)
        half_x, half_y = np.abs(xy * camera.focal_px).max(axis=0)
        # two pixels more on each side for the interpolation
        wide, high = 2 * int(np.ceil(half_x) + 2), 2 * int(np.ceil(half_y) + 2)
        self.pinhole = (wide, high, camera.focal_px)
        uv = xy * camera.focal_px + [(wide - 1) / 2, (high - 1) / 2]
        self._maps = uv.astype(np.float32).reshape(height, width, 2)

    def expose(self, pinhole_image: Image) -> Image:
        """The raw picture (H, W, 3) of a pinhole picture of the size that `pinhole` asks for."""
        if self._maps is None:
            return pinhole_image
        raw = cv2.remap(pinhole_image, self._maps, _NO_MAP, cv2.INTER_LANCZOS4)
        return np.asarray(raw, dtype=np.uint8)


def _pixel_grid(width: int, height: int) -> Array:
    """All pixels (H * W, 2) as (u, v), row by row."""
    u, v = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    return np.column_stack([u.ravel(), v.ravel()])
