"""Dense alignment: the pose under which one picture's patches reappear in another picture.

Gauss-Newton on grey values, as Lucas and Kanade (1981) have it, with one pose instead of one
shift a patch: the patches of the taught picture, lifted onto the board's relief, are projected
into the new picture with its lens. Each patch has its own gain and offset (light, vignetting,
exposure), taken out of residuals and gradients alike. What a patch would like to move by, d, has
the covariance

    s^2 H^-1 + tau^2 I + sigma_h^2 e e^T

grey noise through the patch's structure H, what no model covers (tau), and the doubt about the
height of the surface, which moves the patch along its epipolar direction e. Patches that disagree
with the others count little (Cauchy's weight).
"""

from dataclasses import dataclass

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.relief import Relief
from aoicell.targets.pose import motion_jacobian
from aoicell.transforms import SE3, Array, from_rvec


@dataclass(frozen=True)
class AlignmentConfig:
    """Patches of (2 `radius` + 1)^2 px, at most `patches`, their middles `spacing` px apart.

    `levels` of the pyramid are used, the coarsest first. `height_share`: the surface of a
    component lies within so much of its height (one sigma) of its upper side.
    """

    radius: int = 7
    patches: int = 500
    spacing: int = 12
    levels: int = 2
    smoothing_px: float = 0.8
    steps: int = 15
    height_sigma: float = 1e-4
    height_share: float = 0.25
    block: float = 0.04


@dataclass(frozen=True)
class Patches:
    """P patches of the taught picture: the n points (P, n, 3) on the board that their pixels
    show, their grey values (P, n), their middles (P, 3), and which way (P, 3) the surface there
    may lie elsewhere (one sigma, m).
    """

    points: Array
    values: Array
    middles: Array
    doubts: Array


@dataclass(frozen=True)
class Alignment:
    """The pose that aligns and its covariance (6, 6), as `TargetPose` has it.

    `residuals_px` (P, 2) is what the patches would still like to move by, `weights` (P,) how far
    they were believed (0 to 1), `correlation` (P,) of their grey values with the taught ones.
    """

    T_camera_board: SE3
    covariance: Array
    patches: Patches
    residuals_px: Array
    weights: Array
    correlation: Array

    @property
    def rms_px(self) -> float:
        """Of the residuals, weighted, per patch."""
        squares = (self.residuals_px**2).sum(axis=1)
        return float(np.sqrt(self.weights @ squares / self.weights.sum()))


def pick_patches(grey: Array, relief: Relief, level: int, config: AlignmentConfig) -> Patches:
    """The patches with most structure of a taught picture, at a level of the pyramid.

    Raises ValueError where there is none.
    """
    picture = _smooth(_pyramid(grey, level), config)
    valid = np.isfinite(relief.heights[:: 2**level, :: 2**level]).astype(np.uint8)
    side = 2 * config.radius + 1
    mask = cv2.erode(valid, np.ones((side, side), np.uint8), borderValue=0)
    found = cv2.goodFeaturesToTrack(
        picture, config.patches, 0.002, config.spacing, mask=mask, blockSize=side
    )
    if found is None:
        raise ValueError("no structure")
    middle = np.rint(found[:, 0]).astype(int)
    steps = np.arange(-config.radius, config.radius + 1)
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    uv = middle[:, None] + offsets
    values = picture[uv[..., 1], uv[..., 0]].astype(float)
    points = relief.points(uv * 2.0**level)
    middles = relief.points(middle * 2.0**level)
    _, rays = relief.rays(middle * 2.0**level)
    sigma = config.height_sigma + config.height_share * points[..., 2].max(axis=1)
    return Patches(points, values, middles, rays / rays[:, 2:] * sigma[:, None])


def align(
    taught: Array, new: Array, relief: Relief, camera: Camera, T_start: SE3,
    config: AlignmentConfig = AlignmentConfig(),
) -> Alignment:  # fmt: skip
    """The pose of the board in a new picture (H, W), near T_start, by the taught one's patches."""
    T = T_start
    for level in reversed(range(config.levels)):
        patches = pick_patches(taught, relief, level, config)
        picture = _smooth(_pyramid(new, level), config)
        for _ in range(config.steps):
            seen = _see(picture, patches, camera, T, level)
            solved = _solve(seen, patches, camera, T, relief.T_camera_board)
            delta = solved.delta
            T = SE3(from_rvec(delta[:3], np.zeros(3)).rotation @ T.rotation, T.translation + delta[3:])
            if np.abs(delta * [1, 1, 1, 1, 1, 1]).max() < 1e-6:
                break
    seen = _see(picture, patches, camera, T, 0)
    solved = _solve(seen, patches, camera, T, relief.T_camera_board)
    covariance = _covariance(solved, patches, config.block)
    return Alignment(T, covariance, patches, seen.shifts, solved.weights, seen.correlation)


@dataclass(frozen=True)
class _Seen:
    """What the patches show at a pose: wanted shifts (P, 2) px, and their covariances by grey
    noise (P, 2, 2).
    """

    shifts: Array
    covariances: Array
    correlation: Array
    inside: Array


def _see(picture: Array, patches: Patches, camera: Camera, T: SE3, level: int) -> _Seen:
    count, n, _ = patches.points.shape
    uv = (camera.project(patches.points.reshape(-1, 3), T) / 2**level).astype(np.float32)
    uv = uv.reshape(count, n, 2)
    h, w = picture.shape
    inside = ((uv > 1) & (uv < [w - 2, h - 2])).all(axis=(1, 2))

    def sample(image: Array) -> Array:
        return cv2.remap(image, uv[..., 0], uv[..., 1], cv2.INTER_LINEAR).astype(float)

    gx = cv2.Sobel(picture, cv2.CV_32F, 1, 0, ksize=1, scale=0.5)
    gy = cv2.Sobel(picture, cv2.CV_32F, 0, 1, ksize=1, scale=0.5)
    values, G = sample(picture), np.stack([sample(gx), sample(gy)], axis=2)
    # gain and offset of each patch, out of residuals and gradients
    base = patches.values - patches.values.mean(axis=1, keepdims=True)
    base /= np.linalg.norm(base, axis=1, keepdims=True) + 1e-9
    values = values - values.mean(axis=1, keepdims=True)
    along = (values * base).sum(axis=1)
    correlation = along / (np.linalg.norm(values, axis=1) + 1e-9)
    r = values - along[:, None] * base
    G = G - G.mean(axis=1, keepdims=True)
    G = G - base[..., None] * (base[..., None] * G).sum(axis=1, keepdims=True)
    H = G.transpose(0, 2, 1) @ G + 1e-3 * np.eye(2)
    b = -(G * r[..., None]).sum(axis=1)
    inverse = np.linalg.inv(H)
    shifts = (inverse @ b[..., None])[..., 0]
    noise = (r**2).sum(axis=1) / (n - 4)
    return _Seen(shifts * 2**level, inverse * noise[:, None, None] * 4**level, correlation, inside)


@dataclass(frozen=True)
class _Solved:
    delta: Array
    weights: Array
    normal: Array  # (6, 6)
    pulls: Array  # (P, 6) what each patch adds to the gradient, at the solution


def _solve(seen: _Seen, patches: Patches, camera: Camera, T: SE3, T_taught: SE3) -> _Solved:
    J = motion_jacobian(patches.middles, camera, T).reshape(-1, 2, 6)
    # a surface that lies elsewhere on its taught ray moves in the new picture only
    e = camera.project(patches.middles + patches.doubts, T) - camera.project(patches.middles, T)
    C = seen.covariances + e[:, :, None] * e[:, None, :]
    weights = (seen.inside & (seen.correlation > 0.5)).astype(float)
    tau2, d, delta = 0.05**2, seen.shifts, np.zeros(6)
    for _ in range(5):
        W = np.linalg.inv(C + tau2 * np.eye(2))
        left = d - J @ delta
        distance = np.einsum("pi,pij,pj->p", left, W, left)
        usable = seen.inside & (seen.correlation > 0.5)
        # tau such that the distances are as large as they should be (median of chi2 with 2)
        if usable.any():
            ratio = np.median(distance[usable]) / 1.386
            tau2 = float(np.clip(tau2 * ratio, 1e-4, 4.0))
        weights = usable / (1 + distance / 4)
        A = np.einsum("p,pia,pij,pjb->ab", weights, J, W, J)
        delta = np.linalg.solve(A, np.einsum("p,pia,pij,pj->a", weights, J, W, d))
    left = d - J @ delta
    pulls = np.einsum("p,pia,pij,pj->pa", weights, J, W, left)
    return _Solved(delta, weights, A, pulls)


def _covariance(solved: _Solved, patches: Patches, block: float) -> Array:
    """Sandwich over blocks of the board: neighbouring patches err alike."""
    cells = np.floor(patches.middles[:, :2] / block).astype(int)
    used = solved.weights > 0
    _, which = np.unique(cells[used], axis=0, return_inverse=True)
    which = which.ravel()
    sums = np.zeros((which.max() + 1, 6))
    np.add.at(sums, which, solved.pulls[used])
    g = len(sums)
    inverse = np.linalg.inv(solved.normal)
    return np.asarray(inverse @ (sums.T @ sums) @ inverse * g / (g - 6))


def _pyramid(picture: Array, level: int) -> Array:
    smaller = np.asarray(picture, dtype=np.float32)
    for _ in range(level):
        smaller = cv2.pyrDown(smaller)
    return smaller


def _smooth(picture: Array, config: AlignmentConfig) -> Array:
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), config.smoothing_px))
