"""Fine registration of a new picture to the standard image, with its own quality.

The camera stands nearly where it stood: what differs between the pictures is one small motion of
the board in the camera, six numbers, and the design tells how high each pixel's surface is. Patches
of the reference follow their middles (inverse compositional alignment, Baker and Matthews 2004,
each with its own gain and offset), and those that disagree with the others count little.
"""

from dataclasses import dataclass, field
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.camera import Camera
from aoicell.inspection.sampling import sampled
from aoicell.inspection.shown import MARKER, NOTHING, Shown
from aoicell.observation import Image
from aoicell.patches import PatchConfig, at_level, pick_patches, with_gradients
from aoicell.relief import Relief
from aoicell.targets.pose import motion_jacobian
from aoicell.transforms import SE3, Array, apply, from_rvec

RegistrationState = Literal["registered", "degraded", "no_verdict"]
_THUMB = 8  # the whole picture's shift is first told in one so many times smaller
_LEAST_CONTRAST = 5  # grey values, in a picture that shows anything
_MEDIAN_CHI2 = 1.386  # of two degrees of freedom
_RADIUS_95 = 2.448  # of a two-dimensional normal distribution, in its sigma
_LEAST_BLOCKS = 8  # six numbers cannot be told from fewer, nor how sure they are


@dataclass(frozen=True)
class RegistrationConfig:
    """When a picture counts as registered.

    `registered_px` and `degraded_px` bound the error (95 %) at the worst place of the board that
    the picture shows; at least `min_share` of the patches have to look as in the reference: a
    correlation of `min_correlation`, with the others in agreement. `max_moved_px` is how far the
    view may be off at all. Errors are alike within a `block` of the board (m).
    """

    registered_px: float = 0.5
    degraded_px: float = 2.0
    min_share: float = 0.4
    min_correlation: float = 0.8
    max_moved_px: float = 60.0
    block: float = 0.05
    levels: int = 3
    steps: int = 8
    still_px: float = 0.005
    patch: PatchConfig = field(
        default_factory=lambda: PatchConfig(radius=6, patches=240, spacing=25)
    )


@dataclass(frozen=True)
class FineRegistration:
    """How the new picture lies to the reference: the board's pose in either, `camera` of the new.

    `rms_px` is what the patches still disagree by, weighted; `error_px` what the registration is
    off by at most (95 %) at the worst place, by the scatter of its blocks; `moved_px` how far the
    parts in the picture moved, on the average. `reason` says why the state is not `registered`.
    """

    state: RegistrationState
    T_camera_reference: SE3
    T_camera_board: SE3
    camera: Camera
    rms_px: float = np.inf
    error_px: float = np.inf
    moved_px: float = np.inf
    reason: str = ""

    def project(self, points: Array) -> Array:
        """Where (N, 2) in the new picture points (N, 3) of the board are."""
        return self.camera.project(points, self.T_camera_board)


@dataclass(frozen=True)
class _Level:
    """Patches of one level of the pyramid: their middles (P, 3) on the board, pixels (P, n, 2) of
    the level, unit texture (P, n) and its contrast (P,), the rows (P, 2, n) that tell a shift from
    grey values, and how well they do (P, 2, 2).
    """

    middles: Array
    uv: NDArray[np.float32]
    texture: Array
    contrast: Array
    rows: Array
    information: Array


@dataclass(frozen=True)
class Pattern:
    """All of a reference picture that registration needs; made once by `pattern_of`."""

    thumb: NDArray[np.float32]
    levels: tuple[_Level, ...]
    T_camera_board: SE3
    camera: Camera
    places: Array
    config: RegistrationConfig


def pattern_of(
    grey: Image, shown: Shown, camera: Camera, T_camera_board: SE3, config: RegistrationConfig
) -> Pattern:
    """The patches of a reference picture (H, W) whose surfaces are `shown`."""
    heights = shown.heights.astype(float)
    heights[(shown.numbers == MARKER) | (shown.numbers == NOTHING)] = np.nan
    relief = Relief(heights, camera, T_camera_board)
    flat = _contrast(grey[np.isfinite(heights)]) < _LEAST_CONTRAST
    numbers = range(0 if flat else config.levels)
    levels = tuple(_level(grey, relief, level, config) for level in numbers)
    step = 100
    v, u = np.mgrid[step // 2 : camera.height : step, step // 2 : camera.width : step]
    places = relief.points(np.stack([u, v], axis=-1).reshape(-1, 2).astype(float))
    places = places[np.isfinite(places).all(axis=1)]
    return Pattern(_thumb(grey), levels, T_camera_board, camera, places, config)


def _contrast(values: Image) -> int:
    return int(values.max()) - int(values.min()) if values.size else 0


def _level(grey: Image, relief: Relief, level: int, config: RegistrationConfig) -> _Level:
    patches = pick_patches(grey, relief, level, config.patch)
    middles_px = relief.camera.project(patches.middles, relief.T_camera_board) / 2**level
    steps = np.arange(-config.patch.radius, config.patch.radius + 1)
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    uv = np.rint(middles_px)[:, None] + offsets
    images = with_gradients(at_level(grey, level, config.patch))
    column, row = uv[..., 0].astype(int), uv[..., 1].astype(int)
    values, *slopes = (image[row, column].astype(float) for image in images)
    texture = values - values.mean(axis=1, keepdims=True)
    contrast = np.linalg.norm(texture, axis=1) + 1e-9
    texture /= contrast[:, None]
    G = np.stack(slopes, axis=1)
    G = G - G.mean(axis=2, keepdims=True)
    G = G - (G @ texture[..., None]) * texture[:, None]
    H = G @ G.transpose(0, 2, 1) + 1e-3 * np.eye(2)
    rows = np.linalg.solve(H, G)
    return _Level(patches.middles, uv.astype(np.float32), texture, contrast, rows, H)


def _thumb(grey: Image) -> NDArray[np.float32]:
    size = (grey.shape[1] // _THUMB, grey.shape[0] // _THUMB)
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    return np.asarray(small - small.mean(), np.float32)


def register(new: Image, pattern: Pattern, camera: Camera) -> FineRegistration:
    """The new picture (H, W) of a `camera` against the reference. Never raises: states say why."""
    config, fit = pattern.config, None
    if not pattern.levels:
        return _none(pattern, camera, "the reference has no texture to register by")
    T = _start(new, pattern)
    for number, level in reversed(list(enumerate(pattern.levels))):
        image = at_level(new, number, config.patch)
        for _ in range(config.steps):
            fit = _fit(image, level, number, pattern, camera, T)
            if fit is None:
                return _none(pattern, camera, "nothing in the picture looks like the reference")
            T = SE3(
                from_rvec(fit.delta[:3], np.zeros(3)).rotation @ T.rotation,
                T.translation + fit.delta[3:],
            )
            if np.abs(fit.J @ fit.delta).max() < config.still_px * 4**number:
                break
    assert fit is not None
    return _judged(fit, level.middles, pattern, camera, T)


def _start(new: Image, pattern: Pattern) -> SE3:
    """The pose that shifts the whole picture as its small copy says (phase correlation)."""
    window = cv2.createHanningWindow(pattern.thumb.shape[::-1], cv2.CV_32F)
    # copies: OpenCV multiplies what it is given by the window, in place
    (u, v), _ = cv2.phaseCorrelate(pattern.thumb.copy(), _thumb(new), window)
    T, camera = pattern.T_camera_board, pattern.camera
    depth = float(np.median(apply(T, pattern.places)[:, 2])) if len(pattern.places) else 1.0
    shift = np.array([u, v]) * _THUMB / np.diag(camera.K)[:2] * depth
    return SE3(T.rotation, T.translation + np.append(shift, 0))


@dataclass(frozen=True)
class _Fit:
    """A step (6,), the Jacobians (P, 2, 6), and of each patch its pull on the pose (P, 6), how fast
    that changes (P, 6, 6), its weight, its correlation and what it would still move by (P, 2).
    """

    delta: Array
    J: Array
    pulls: Array
    slopes: Array
    weights: Array
    correlation: Array
    shifts: Array


def _fit(
    image: NDArray[np.float32], level: _Level, number: int, pattern: Pattern, camera: Camera, T: SE3
) -> _Fit | None:
    before = pattern.camera.project(level.middles, pattern.T_camera_board)
    flow = (camera.project(level.middles, T) - before) / 2**number
    at = level.uv + flow[:, None].astype(np.float32)
    height, width = image.shape
    inside = ((at > 1) & (at < [width - 2, height - 2])).all(axis=(1, 2))
    values = sampled(image, at[..., 0], at[..., 1]).astype(float)
    values -= values.mean(axis=1, keepdims=True)
    along = (values * level.texture).sum(axis=1)
    correlation = along / (np.linalg.norm(values, axis=1) + 1e-9)
    usable = inside & (correlation > pattern.config.patch.min_correlation)
    if usable.sum() < 12:
        return None
    gain = np.linalg.norm(values, axis=1)
    residual = values - along[:, None] * level.texture
    # the texture's own contrast is in `rows`: a darker new patch moves as far as a bright one
    scale = level.contrast / np.maximum(gain, 1e-6)
    shifts = -(level.rows @ residual[..., None])[..., 0] * scale[:, None] * 2**number
    n = values.shape[1]
    noise = (residual**2).sum(axis=1) / (n - 4) * scale**2 * 4**number
    C = np.linalg.inv(level.information) * noise[:, None, None]
    J = motion_jacobian(level.middles, camera, T).reshape(-1, 2, 6)
    return _robust(shifts, C, J, usable, correlation)


def _robust(
    shifts: Array, C: Array, J: Array, usable: NDArray[np.bool_], correlation: Array
) -> _Fit:
    """The step that serves the patches' wishes best; Cauchy's weight, scatter by iteration."""
    tau2, delta = 0.05**2, np.zeros(6)
    for _ in range(5):
        W = np.linalg.inv(C + tau2 * np.eye(2))
        left = shifts - J @ delta
        distance = np.einsum("pi,pij,pj->p", left, W, left)
        tau2 = float(np.clip(tau2 * np.median(distance[usable]) / _MEDIAN_CHI2, 1e-5, 9.0))
        weights = usable / (1 + distance / 4)
        JW = J.transpose(0, 2, 1) @ W * weights[:, None, None]
        delta = np.linalg.solve((JW @ J).sum(axis=0), np.einsum("pai,pi->a", JW, shifts))
    left = shifts - J @ delta
    return _Fit(delta, J, np.einsum("pai,pi->pa", JW, left), JW @ J, weights, correlation, left)


def _judged(
    fit: _Fit, middles: Array, pattern: Pattern, camera: Camera, T: SE3
) -> FineRegistration:
    """The registration with its state, and why it is no better."""
    config = pattern.config
    squares = (fit.shifts**2).sum(axis=1)
    rms_px = float(np.sqrt(fit.weights @ squares / max(fit.weights.sum(), 1e-9)))
    error_px = _worst_px(_covariance(fit, middles, config.block), pattern.places, camera, T)
    before = pattern.camera.project(pattern.places, pattern.T_camera_board)
    moved = np.linalg.norm(camera.project(pattern.places, T) - before, axis=1)
    moved_px = float(moved.mean()) if len(moved) else np.inf
    share = float(((fit.correlation > config.min_correlation) & (fit.weights > 0.2)).mean())
    state: RegistrationState = "registered"
    reason = ""
    if not error_px <= config.degraded_px:
        state = "no_verdict"
        reason = f"off by up to {error_px:.1f} px, {config.degraded_px:g} px are accepted"
    elif share < config.min_share:
        state = "no_verdict"
        reason = f"{share:.0%} of its patches look as they should, {config.min_share:.0%} must"
    elif moved_px > config.max_moved_px:
        state = "no_verdict"
        reason = f"the view is {moved_px:.0f} px off, {config.max_moved_px:g} px are accepted"
    elif error_px > config.registered_px:
        state = "degraded"
        reason = f"off by up to {error_px:.1f} px, {config.registered_px:g} px are wanted"
    T_reference = pattern.T_camera_board
    return FineRegistration(state, T_reference, T, camera, rms_px, error_px, moved_px, reason)


def _covariance(fit: _Fit, middles: Array, side: float) -> Array:
    """Of the pose (6, 6), from how the blocks of the board disagree (robust to alike neighbours).

    The sandwich of a clustered regression (Liang and Zeger 1986).
    """
    cells = np.floor(middles[:, :2] / side).astype(int)
    which = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
    count = int(which.max()) + 1
    pulls = np.zeros((count, 6))
    np.add.at(pulls, which, fit.pulls)
    used = int((np.abs(pulls).sum(axis=1) > 0).sum())
    if used < _LEAST_BLOCKS:
        return np.full((6, 6), np.inf)
    inverse = np.linalg.inv(fit.slopes.sum(axis=0))
    return np.asarray(inverse @ (pulls.T @ pulls) @ inverse * used / (used - 6))


def _worst_px(covariance: Array, places: Array, camera: Camera, T: SE3) -> float:
    """The radius (px) that holds 95 % of the errors at the worst of the places (N, 3)."""
    if not np.isfinite(covariance).all() or not len(places):
        return np.inf
    J = motion_jacobian(places, camera, T).reshape(-1, 2, 6)
    spreads = J @ covariance @ J.transpose(0, 2, 1)
    return _RADIUS_95 * float(np.sqrt(np.linalg.eigvalsh(spreads)[:, -1].max()))


def _none(pattern: Pattern, camera: Camera, reason: str) -> FineRegistration:
    T = pattern.T_camera_board
    return FineRegistration("no_verdict", T, T, camera, reason=reason)
