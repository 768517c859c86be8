"""Patches of a taught picture, and how far each has moved in another: photometry alone.

Lucas and Kanade's (1981) step for every patch by itself. Each has its own gain and offset (light,
vignetting, exposure), taken out of residuals and gradients alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.relief import Relief
from aoicell.transforms import SE3, Array

Picture = NDArray[np.float32]


@dataclass(frozen=True)
class PatchConfig:
    """At most `patches` of (2 `radius` + 1)^2 px, their middles `spacing` px apart, in pictures
    smoothed by a Gaussian of `smoothing_px`.

    `height_sigma` (m): of every surface; one on a component lies, besides, within `height_share`
    of its height from its upper side (one sigma). Patches that correlate by less than
    `min_correlation` do not count.
    """

    radius: int = 7
    patches: int = 500
    spacing: int = 12
    smoothing_px: float = 0.8
    height_sigma: float = 1e-4
    height_share: float = 1.0
    min_correlation: float = 0.5


@dataclass(frozen=True)
class Patches:
    """P patches of the taught picture: the n points (P, n, 3) on the board that their pixels
    show, their grey values (P, n), their middles (P, 3), and by what (P, 3) the surface there
    may lie elsewhere along the ray (one sigma, m).
    """

    points: Array
    values: Array
    middles: Array
    doubts: Array


@dataclass(frozen=True)
class Wishes:
    """What each patch wants to move by (P, 2) px, the covariance of that by grey noise (P, 2, 2),
    its correlation (P,) with the taught one, and whether it counts at all (P,).
    """

    shifts: Array
    covariances: Array
    correlation: Array
    usable: NDArray[np.bool_]


def pick_patches(grey: Image, relief: Relief, level: int, config: PatchConfig) -> Patches:
    """The patches with most structure of a taught picture (H, W), at a level of the pyramid."""
    picture, scale = at_level(grey, level, config), 2**level
    side = 2 * config.radius + 1
    board = np.isfinite(relief.heights[::scale, ::scale]).astype(np.uint8)
    mask = cv2.erode(board, np.ones((side, side), np.uint8), borderValue=0)
    found = cv2.goodFeaturesToTrack(
        picture, config.patches, 0.002, config.spacing, mask=mask, blockSize=side
    )
    middles = np.zeros((0, 2), int) if found is None else np.rint(found[:, 0]).astype(int)
    steps = np.arange(-config.radius, config.radius + 1)
    uv = middles[:, None] + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    points = relief.points(uv * scale)
    _, rays = relief.rays(middles * scale)
    sigma = np.hypot(config.height_sigma, config.height_share * points[..., 2].max(axis=1))
    return Patches(
        points,
        picture[uv[..., 1], uv[..., 0]].astype(float),
        relief.points(middles * scale),
        rays / rays[:, 2:] * sigma[:, None],
    )


def wishes(
    images: Sequence[Picture],
    patches: Patches,
    camera: Camera,
    T_camera_board: SE3,
    level: int,
    config: PatchConfig,
) -> Wishes:
    """Of the patches at a pose; `images`: the new picture at that level and its gradients."""
    count, n, _ = patches.points.shape
    uv = camera.project(patches.points.reshape(-1, 3), T_camera_board) / 2**level
    uv = uv.astype(np.float32).reshape(count, n, 2)
    height, width = images[0].shape
    inside = ((uv > 1) & (uv < [width - 2, height - 2])).all(axis=(1, 2))
    if not count:
        return Wishes(np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros(0), inside)
    values, *slopes = (
        cv2.remap(image, uv[..., 0], uv[..., 1], cv2.INTER_LINEAR).astype(float) for image in images
    )
    base = _centred(patches.values)
    base /= np.linalg.norm(base, axis=1, keepdims=True) + 1e-9
    values, G = _centred(values), _centred(np.stack(slopes, axis=2))
    along = (values * base).sum(axis=1)
    correlation = along / (np.linalg.norm(values, axis=1) + 1e-9)
    residual = values - along[:, None] * base
    G = G - base[..., None] * (base[..., None] * G).sum(axis=1, keepdims=True)
    inverse = np.linalg.inv(G.transpose(0, 2, 1) @ G + 1e-3 * np.eye(2))
    shifts = -(inverse @ (G * residual[..., None]).sum(axis=1)[..., None])[..., 0]
    noise = (residual**2).sum(axis=1) / (n - 4)
    usable = inside & (correlation > config.min_correlation)
    return Wishes(shifts * 2**level, inverse * noise[:, None, None] * 4**level, correlation, usable)


def _centred(values: Array) -> Array:
    return np.asarray(values - values.mean(axis=1, keepdims=True))


def at_level(grey: Image, level: int, config: PatchConfig) -> Picture:
    """A level of the picture's pyramid, smoothed; its pixel (u, v) is 2^level (u, v) below."""
    picture: Picture = np.asarray(grey, dtype=np.float32)
    for _ in range(level):
        picture = np.asarray(cv2.pyrDown(picture), dtype=np.float32)
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), config.smoothing_px), dtype=np.float32)


def with_gradients(picture: Picture) -> list[Picture]:
    """The picture and its gradients by u and v (central differences)."""
    slopes = (cv2.Sobel(picture, cv2.CV_32F, *xy, ksize=1, scale=0.5) for xy in ((1, 0), (0, 1)))
    return [picture, *(np.asarray(slope, dtype=np.float32) for slope in slopes)]
