"""Dense alignment: the pose under which the patches of one picture reappear in another.

Gauss-Newton on grey values with one pose instead of a shift for each patch: patches of the taught
picture, lifted onto the board's relief, are projected into the new one with its lens. What a
patch would still like to move by has the covariance

    s^2 H^-1 + tau^2 I + e e^T

grey noise through the patch's structure H, what no model covers (tau, from the scatter of the
patches), and the doubt about the height of the surface, which moves it along e. Patches that
disagree with the others count little (Cauchy's weight).
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.patches import (
    PatchConfig,
    Patches,
    Wishes,
    at_level,
    pick_patches,
    wishes,
    with_gradients,
)
from aoicell.relief import Relief
from aoicell.targets.pose import motion_jacobian
from aoicell.transforms import SE3, Array, from_rvec

_MEDIAN_CHI2 = 1.386  # of two degrees of freedom
_LEAST_BLOCKS = 8  # six numbers cannot be told from fewer, nor how sure they are


@dataclass(frozen=True)
class AlignmentConfig:
    """`levels` of the pyramid, the coarsest first; at most `steps` in each, until nothing moves
    by `still_px`. Errors are alike within a `block` of the board (m).
    """

    levels: int = 2
    steps: int = 15
    still_px: float = 0.003
    block: float = 0.06
    patch: PatchConfig = field(default_factory=PatchConfig)


@dataclass(frozen=True)
class Alignment:
    """The pose that aligns and its covariance (6, 6), as `TargetPose` has it, in `blocks` blocks.

    Of each patch: its middle (P, 3) on the board, the pixels (P, 2) that it would still like to
    move by, how far it was believed (0 to 1), its correlation with the taught one.
    """

    T_camera_board: SE3
    covariance: Array
    blocks: int
    middles: Array
    residuals_px: Array
    weights: Array
    correlation: Array

    @property
    def rms_px(self) -> float:
        """Of the residuals, per patch, weighted."""
        squares = (self.residuals_px**2).sum(axis=1)
        return float(np.sqrt(self.weights @ squares / max(self.weights.sum(), 1e-9)))


def align(
    taught: Image,
    new: Image,
    relief: Relief,
    camera: Camera,
    T_start: SE3,
    config: AlignmentConfig = AlignmentConfig(),
) -> Alignment | None:
    """The board in a new picture (H, W), some pixels from T_start, by the taught picture.

    None where too few patches are left to tell a pose and its covariance.
    """
    T = T_start
    for level in reversed(range(config.levels)):
        patches = pick_patches(taught, relief, level, config.patch)
        images = with_gradients(at_level(new, level, config.patch))
        for _ in range(config.steps):
            seen = wishes(images, patches, camera, T, level, config.patch)
            which = _blocks(patches, seen.usable, config.block)
            if which.max(initial=-1) + 1 < _LEAST_BLOCKS:
                return None
            fit = _fit(seen, patches, camera, T)
            turn = from_rvec(fit.delta[:3], np.zeros(3)).rotation
            T = SE3(turn @ T.rotation, T.translation + fit.delta[3:])
            if np.abs(fit.J @ fit.delta).max() < config.still_px * 2**level:
                break
    return Alignment(
        T, _jackknife(fit, which[seen.usable], seen.usable), int(which.max()) + 1,
        patches.middles, seen.shifts, fit.weights, seen.correlation,
    )  # fmt: skip


@dataclass(frozen=True)
class _Fit:
    """A step (6,), the patches' Jacobians (P, 2, 6) and weights, and for each patch its pull
    (P, 6) on the pose and how fast that changes with the pose (P, 6, 6), at the solution.
    """

    delta: Array
    J: Array
    weights: Array
    pulls: Array
    slopes: Array


def _fit(seen: Wishes, patches: Patches, camera: Camera, T: SE3) -> _Fit:
    """The step that serves the patches' wishes best: weights and tau^2 by iteration."""
    J = motion_jacobian(patches.middles, camera, T).reshape(-1, 2, 6)
    # a surface that lies elsewhere on its taught ray moves in the new picture only
    e = camera.project(patches.middles + patches.doubts, T) - camera.project(patches.middles, T)
    C = seen.covariances + e[:, :, None] * e[:, None, :]
    tau2, delta = 0.05**2, np.zeros(6)
    for _ in range(6):
        W = np.linalg.inv(C + tau2 * np.eye(2))
        left = seen.shifts - J @ delta
        distance = np.einsum("pi,pij,pj->p", left, W, left)
        tau2 = float(np.clip(tau2 * np.median(distance[seen.usable]) / _MEDIAN_CHI2, 1e-4, 4.0))
        weights = seen.usable / (1 + distance / 4)
        JW = J.transpose(0, 2, 1) @ W * weights[:, None, None]
        A = (JW @ J).sum(axis=0)
        delta = np.linalg.solve(A, np.einsum("pai,pi->a", JW, seen.shifts))
    pulls = np.einsum("pai,pi->pa", JW, seen.shifts - J @ delta)
    # a weight falls as its residual grows: the derivative of w W d is w W - w^2/2 W d (W d)^T
    slopes = JW @ J - pulls[:, :, None] * pulls[:, None, :] / 2
    return _Fit(delta, J, weights, pulls, slopes)


def _blocks(patches: Patches, usable: NDArray[np.bool_], side: float) -> NDArray[np.intp]:
    """The number of the block of the board that each patch is in, from 0; -1 if not usable."""
    numbers = np.full(len(usable), -1, dtype=np.intp)
    cells = np.floor(patches.middles[usable, :2] / side).astype(int)
    if len(cells):
        numbers[usable] = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
    return numbers


def _jackknife(fit: _Fit, which: NDArray[np.intp], usable: NDArray[np.bool_]) -> Array:
    """Covariance (6, 6) from what leaving out one block after the other does to the pose.

    Neighbouring patches err alike: patches by themselves would promise too much (the
    delete-a-group jackknife, Kott 2001, to first order).
    """
    count = int(which.max()) + 1
    pulls, slopes = np.zeros((count, 6)), np.zeros((count, 6, 6))
    np.add.at(pulls, which, fit.pulls[usable])
    np.add.at(slopes, which, fit.slopes[usable])
    moves = np.linalg.solve(slopes.sum(axis=0) - slopes, -pulls[:, :, None])[..., 0]
    return np.asarray(moves.T @ moves * (count - 1) / count)
