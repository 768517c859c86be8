"""Hand-eye calibration from pose pairs alone: robust, and as likely as can be.

For recordings without pictures: T_base_flange from the arm beside T_camera_target from any
tracker. A X B = Z, with X = T_flange_camera and Z = T_base_target (eye in hand), or with A
inverted, X = T_base_camera and Z = T_flange_target (eye to hand). Closed forms start it; the
noise of both sides is estimated from the residuals, and poses that do not fit lose their weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin
from scipy.special import chdtri

from aoicell.calibration.bundle import outlier_weight
from aoicell.calibration.closed_forms import scale_from_motion
from aoicell.calibration.pose_noise import FORMS, Form, PoseNoise, covariances, most_likely
from aoicell.calibration.problem import Mask
from aoicell.calibration.starts import PairStart, solve_pair
from aoicell.errors import Implausible, InputError
from aoicell.transforms import SE3, Array, is_rigid

Mount = Literal["eye_in_hand", "eye_to_hand"]
_LIMIT = float(chdtri(6, 2e-3))  # squared distance of a pose beyond which it is an outlier
_TRUSTED = 0.1  # weight from which a pose has a say about the noise
_SQUARE = np.array([[-0.05, 0.05, 0], [0.05, 0.05, 0], [0.05, -0.05, 0], [-0.05, -0.05, 0]])
_ROUNDS, _STEPS = 5, 30
_SURE = 10.0  # by how much twice the log likelihood has to grow to believe in another scale


@dataclass(frozen=True)
class PosePairsConfig:
    """Forms of the camera's noise to try, and whether its translations may be scaled.

    A `free` scale is for trackers that know lengths up to a factor (one moving camera).
    """

    forms: tuple[Form, ...] = FORMS
    scale: Literal["known", "free"] = "known"


@dataclass(frozen=True)
class PosePairs:
    """X and Z with their covariance, and what the pairs say of themselves.

    `covariance` (12, 12) belongs to twists (m, rad) of X and Z in their own axes; `scale` is how
    much longer the tracker's lengths are than the arm's. `weights` (N,) are 1 for pairs that
    fit. `minus_twice_log` is minus twice the log likelihood: the smaller, the likelier.
    """

    X: SE3
    Z: SE3
    covariance: Array
    scale: float
    noise: PoseNoise
    weights: Array
    minus_twice_log: float


def solve_pose_pairs(
    Ts_base_flange: Sequence[SE3], Ts_camera_target: Sequence[SE3],
    mount: Mount = "eye_in_hand", config: PosePairsConfig = PosePairsConfig(),
) -> PosePairs:  # fmt: skip
    """The most likely X and Z over at least four pairs.

    Raises InputError on pairs that are none, and Implausible when no closed form gives a start
    or the pairs do not tell all of X (all rotations about one axis, pure translations).
    """
    _check(Ts_base_flange, Ts_camera_target)
    As = list(Ts_base_flange)
    if mount == "eye_to_hand":
        As = [A.inverse() for A in As]
    start = solve_pair(As, Ts_camera_target, _SQUARE)
    pairs = _Pairs(tuple(A.inverse() for A in As), tuple(Ts_camera_target), mount)
    first = _Guess(start.T_mount_eye, start.T_mount_fixture, 1.0)
    found = [_refined(pairs, first, form, scaled=False) for form in config.forms]
    if config.scale == "free":
        found += _scaled(pairs, As, start, config, min(f.minus_twice_log for f in found))
    best = min(found, key=lambda f: f.minus_twice_log)
    if not (is_rigid(best.X, 1e-6) and is_rigid(best.Z, 1e-6)):
        raise Implausible("pose pairs: the refinement left no rigid transform; check the poses")
    return best


def _check(As: Sequence[SE3], Bs: Sequence[SE3]) -> None:
    if len(As) != len(Bs):
        raise InputError(f"pose pairs: {len(As)} poses of the flange and {len(Bs)} of the target")
    if len(As) < 4:
        raise Implausible(f"pose pairs: {len(As)} are too few to solve and check; take at least 4")
    for what, Ts in (("T_base_flange", As), ("T_camera_target", Bs)):
        for k, T in enumerate(Ts):
            if not is_rigid(T, 1e-4):
                raise InputError(f"pose pairs: {what} of pair {k + 1} is no rigid transform")


def _scaled(
    pairs: "_Pairs", As: Sequence[SE3], start: PairStart, config: PosePairsConfig, likely: float
) -> list[PosePairs]:
    """Solutions with another scale, where the motion tells one and they are likelier for sure.

    Towards a scale of 0 the arm says nothing any more and everything fits: that is no answer.
    """
    factor, std, X = scale_from_motion(As, pairs.Bs, start.T_mount_eye)
    if not (0 < 5 * std < abs(factor - 1) and 10 * std < factor):
        return []
    Z = SE3(start.T_mount_fixture.rotation, _mean_origin(As, pairs.Bs, X, factor))
    tried = [_refined(pairs, _Guess(X, Z, 1 / factor), form, scaled=True) for form in config.forms]
    return [
        s for s in tried
        if s.minus_twice_log < likely - _SURE and 0.5 < s.scale * factor < 2
    ]  # fmt: skip


def _mean_origin(As: Sequence[SE3], Bs: Sequence[SE3], X: SE3, factor: float) -> Array:
    places = [A.act(X.act(factor * B.translation)) for A, B in zip(As, Bs, strict=True)]
    return np.asarray(np.median(places, axis=0))


@dataclass(frozen=True)
class _Guess:
    X: SE3
    Z: SE3
    scale: float


@dataclass(frozen=True)
class _Linear:
    """Residuals (N, 6) in camera axes about the target's origin, measured less predicted.

    `J` (N, 6, P) derivatives of the prediction by twists of X and Z (and the scale),
    `by_flange` (N, 6, 6) by a twist of the flange.
    """

    residuals: Array
    J: Array
    by_flange: Array


@dataclass(frozen=True)
class _Pairs:
    """F with T_camera_target = X^-1 F Z, and T_camera_target as measured."""

    Fs: tuple[SE3, ...]
    Bs: tuple[SE3, ...]
    mount: Mount

    def linearise(self, at: _Guess, scaled: bool) -> _Linear:
        T_eye_mount, s = at.X.inverse(), at.scale
        count, eye = len(self.Fs), np.eye(3)
        r = np.zeros((count, 6))
        J = np.zeros((count, 6, 13 if scaled else 12))
        for i, (F, B) in enumerate(zip(self.Fs, self.Bs, strict=True)):
            T = T_eye_mount * F * at.Z
            R, t = T.rotation, T.translation
            r[i, :3] = B.translation - s * t
            r[i, 3:] = pin.log3(B.rotation @ R.T)
            J[i, :3, :3], J[i, :3, 3:6], J[i, 3:, 3:6] = -s * eye, s * pin.skew(t), -eye
            J[i, :3, 6:9], J[i, 3:, 9:12] = s * R, R
            if scaled:
                J[i, :3, 12] = t
        if self.mount == "eye_in_hand":
            by_flange = J[:, :, :6] @ T_eye_mount.toActionMatrix()
        else:
            by_flange = J[:, :, 6:12] @ at.Z.toActionMatrixInverse()
        return _Linear(r, J, by_flange)

    def some(self, chosen: Mask) -> "_Pairs":
        keep = np.flatnonzero(chosen).tolist()
        return _Pairs(tuple(self.Fs[i] for i in keep), tuple(self.Bs[i] for i in keep), self.mount)


def _refined(pairs: _Pairs, start: _Guess, form: Form, scaled: bool) -> PosePairs:
    """Noise and poses in turn, until the weights and the noise settle."""
    noise, guess = PoseNoise.expected(form), start
    weights = _first_weights(pairs, start, scaled)
    minus_twice_log = np.inf
    for _ in range(_ROUNDS):
        lin = pairs.linearise(guess, scaled)
        trusted = weights > _TRUSTED
        inner = pairs.some(trusted)
        before = noise.logs
        noise, minus_twice_log = most_likely(
            noise, inner.Bs, lin.residuals[trusted], lin.J[trusted], lin.by_flange[trusted]
        )
        guess, weights, covariance = _fitted(pairs, guess, noise, scaled)
        if np.abs(noise.logs - before).max() < 0.05:
            break
    # as many pairs as all, or a form could win by distrusting half of them
    cost = minus_twice_log / max(int(trusted.sum()), 1) * len(pairs.Bs)
    return PosePairs(guess.X, guess.Z, covariance[:12, :12], guess.scale, noise, weights, cost)


def _first_weights(pairs: _Pairs, start: _Guess, scaled: bool) -> Array:
    """By the spread of translations and rotations about the start, robustly."""
    r = pairs.linearise(start, scaled).residuals
    far = np.zeros(len(r))
    for part in (r[:, :3], r[:, 3:]):
        size = (part**2).sum(axis=1)
        far += 3 * size / max(float(np.median(size)), 1e-18)
    return outlier_weight(far, 3 * _LIMIT)


def _fitted(
    pairs: _Pairs, guess: _Guess, noise: PoseNoise, scaled: bool
) -> tuple[_Guess, Array, Array]:
    """Gauss-Newton with weights that fall with the distance of a pair."""
    weights = np.ones(len(pairs.Bs))
    covariance = np.zeros((13 if scaled else 12,) * 2)
    for _ in range(_STEPS):
        lin = pairs.linearise(guess, scaled)
        V = covariances(noise, pairs.Bs, lin.by_flange)
        solved = np.linalg.solve(V, np.concatenate([lin.J, lin.residuals[:, :, None]], axis=2))
        d2 = np.einsum("ni,ni->n", lin.residuals, solved[:, :, -1])
        weights = outlier_weight(d2, _LIMIT)
        H = np.einsum("n,nij,nik->jk", weights, lin.J, solved[:, :, :-1])
        b = np.einsum("n,nij,ni->j", weights, lin.J, solved[:, :, -1])
        covariance = _inverse(H)
        step = covariance @ b
        scale = guess.scale + (float(step[12]) if scaled else 0.0)
        guess = _Guess(guess.X * pin.exp6(step[:6]), guess.Z * pin.exp6(step[6:12]), scale)
        if step @ b < 1e-6:
            break
    return guess, weights, covariance


def _inverse(H: Array) -> Array:
    """Raises Implausible where the pairs do not tell everything."""
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    eigenvalues, vectors = np.linalg.eigh(H / np.outer(scale, scale))
    if not eigenvalues[0] > 1e-13 * eigenvalues[-1]:
        raise Implausible(
            "pose pairs: they do not tell all of the hand-eye; turn the flange about two axes "
            "by 15 deg or more"
        )
    return np.asarray((vectors / eigenvalues) @ vectors.T / np.outer(scale, scale))
