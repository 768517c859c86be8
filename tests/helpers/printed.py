"""Pictures of prints at known poses: sampled four times finer through lens and pose, averaged,
blurred, noisy.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Protocol

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.sighting import CalibrationTarget, Sighting
from aoicell.transforms import SE3, Array, looking_at

FINER = 4
_STEP = 8  # the lens is sampled at every eighth fine pixel and interpolated
BACKGROUND = 90

BENT = Camera(
    np.array([[905.0, 0, 322.0], [0, 901.0, 236.0], [0, 0, 1]]), 640, 480,
    np.array([-0.12, 0.05, 1e-3, -5e-4, 0]),
)  # fmt: skip


class Printed(CalibrationTarget, Protocol):
    """A target that draws itself."""

    @property
    def size(self) -> tuple[float, float]: ...

    def print_image(self, pixels_per_metre: float) -> Image: ...


def seen_from(
    tilt: tuple[float, float] = (0.0, 0.0),
    roll: float = 0.3,
    distance: float = 0.5,
    aim: tuple[float, float] = (0.0, 0.0),
) -> SE3:
    """T_camera_target of a camera that looks at (x, y) of the target (m, rad)."""
    return looking_at([*aim, 0], distance, tilt, roll).inverse()


def picture(
    *prints: tuple[Printed, SE3],
    camera: Camera = BENT,
    blur_px: float = 0.6,
    noise: float = 1.0,
    seed: int = 0,
    cover: Callable[[Image], None] | None = None,
) -> Image:
    """The prints at their poses T_camera_target over grey, black at 30 and white at 210.

    `cover` may paint over the fine picture, FINER times as large.
    """
    xy = _rays(camera.K.tobytes(), camera.distortion.tobytes(), camera.width, camera.height)
    fine = np.full(xy.shape[:2], BACKGROUND, dtype=np.uint8)
    for target, T in prints:
        _lay(fine, xy, target, T, camera)
    if cover is not None:
        cover(fine)
    small = cv2.resize(fine, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    exposed = cv2.GaussianBlur(small.astype(np.float32), (0, 0), blur_px)
    exposed += noise * np.random.default_rng(seed).standard_normal(exposed.shape)
    return np.clip(np.round(exposed), 0, 255).astype(np.uint8)


def rms_off(seen: Sighting, target: CalibrationTarget, T: SE3, camera: Camera = BENT) -> float:
    """Distance of a sighting from the projection of its points, rms (px)."""
    gaps = seen.uv_px - camera.project(target.points[seen.ids], T)
    return float(np.sqrt((gaps**2).sum(axis=1).mean()))


@lru_cache(maxsize=4)
def _rays(K: bytes, distortion: bytes, width: int, height: int) -> Array:
    """Normalised image points (H, W, 2) of all fine pixels."""
    camera = Camera(np.frombuffer(K).reshape(3, 3), width, height, np.frombuffer(distortion))
    u, v = (np.arange(0, n * FINER + _STEP, _STEP) for n in (width, height))
    coarse = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    xy = camera.unproject((coarse + 0.5) / FINER - 0.5).reshape(len(v), len(u), 2)
    rows = _between(xy, height * FINER).swapaxes(0, 1)
    return _between(rows, width * FINER).swapaxes(0, 1).astype(np.float32, order="C")


def _between(samples: Array, count: int) -> Array:
    """Linear interpolation along the first axis."""
    index, share = np.divmod(np.arange(count), _STEP)
    share = share.reshape(-1, *[1] * (samples.ndim - 1)) / _STEP
    blended: Array = samples[index] * (1 - share) + samples[index + 1] * share
    return blended


def _lay(fine: Image, xy: Array, target: Printed, T: SE3, camera: Camera) -> None:
    """Paints one print; it has about one texel in a fine pixel."""
    texture = target.print_image(FINER * camera.focal_px / T.translation[2])
    (width, height), (rows, columns) = target.size, texture.shape
    corners = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * [width, height, 0] / 2
    where = camera.project(corners, T) * FINER
    low = np.maximum(where.min(axis=0).astype(int) - 40, 0)  # the sides are not quite straight
    high = where.max(axis=0).astype(int) + 40
    part = np.s_[low[1] : high[1], low[0] : high[0]]
    texel = np.array(
        [[columns / width, 0, columns / 2 - 0.5], [0, -rows / height, rows / 2 - 0.5], [0, 0, 1]]
    )
    H = texel @ np.linalg.inv(np.column_stack([T.rotation[:, :2], T.translation]))
    uv = cv2.perspectiveTransform(np.ascontiguousarray(xy[part]), H)
    ink = cv2.remap(texture, uv, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    u, v = uv[..., 0], uv[..., 1]
    inside = (u >= -0.5) & (u <= columns - 0.5) & (v >= -0.5) & (v <= rows - 0.5)
    fine[part] = np.where(inside, 30 + ink * (180 / 255), fine[part]).astype(np.uint8)


class Paper:
    """A chessboard as something that draws itself at any scale, margin included."""

    def __init__(self, board: Chessboard) -> None:
        self.board = board
        self.points, self.half_turns = board.points, board.half_turns
        self.T_target_opencv, self.size, self.sight = board.T_target_opencv, board.size, board.sight

    def print_image(self, pixels_per_metre: float) -> Image:
        return self.board.print_image(round(pixels_per_metre * self.board.square))
