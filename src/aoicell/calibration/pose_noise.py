"""How noisy pose pairs are: what a target's pose from one picture, and an arm's pose, may be off.

A pose from a picture is no even cloud: the same noise in the picture moves a target much more
along the line of sight than across it, and a small one is tilted more than it is rolled. Two
forms are tried: that of points of a flat target seen by a pinhole, (J'J)^-1 (of a square of
points: its size and one noise), and three plain standard deviations along the camera's axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import minimize

from aoicell.calibration.measurement import cross
from aoicell.transforms import SE3, Array

Form = Literal["points", "even"]
FORMS: tuple[Form, ...] = ("points", "even")
# Logarithms of what is expected and limits: the picture's noise over the focal length and the
# half size of the target (m); lateral and depth (m) and rotation (rad); the flange (m, rad).
_STARTS = {"points": (5e-4, 0.06), "even": (1e-3, 3e-3, 3e-3)}
_FLANGE = (3e-4, 3e-4)
_WIDTH = 2.0  # of the belief about the flange: within a factor of seven
_LOWEST = {"points": (1e-6, 5e-3), "even": (1e-6, 1e-6, 1e-6)}
_LOWEST_FLANGE, _HIGHEST = 1e-6, 1.0
_GRID = np.array([[x, y, 0.0] for x in (-1, 0, 1) for y in (-1, 0, 1)])


@dataclass(frozen=True)
class PoseNoise:
    """Standard deviations: `camera` (2,) or (3,) as the form has them, `flange` (2,) in m, rad."""

    form: Form
    camera: Array
    flange: Array

    @property
    def logs(self) -> Array:
        """All of them as logarithms."""
        return np.asarray(np.log(np.concatenate([self.camera, self.flange])))

    @classmethod
    def expected(cls, form: Form) -> "PoseNoise":
        """Where the search starts."""
        return cls(form, np.array(_STARTS[form]), np.array(_FLANGE))


def camera_covariances(form: Form, camera: Array, Ts_camera_target: Sequence[SE3]) -> Array:
    """Covariances (N, 6, 6) of (m, rad) about the target's origin, in the camera's axes."""
    if form == "even":
        lateral, depth, turn = camera**2
        diagonal = np.array([lateral, lateral, depth, turn, turn, turn])
        return np.tile(np.diag(diagonal), (len(Ts_camera_target), 1, 1))
    sigma, half = camera
    R = np.array([T.rotation for T in Ts_camera_target])
    t = np.array([T.translation for T in Ts_camera_target])
    arms = half * np.einsum("pk,njk->npj", _GRID, R)
    x, y, z = np.moveaxis(arms + t[:, None], -1, 0)
    z = np.where(np.abs(z) > 1e-3, z, 1e-3)
    zero = np.zeros_like(z)
    by_point = np.stack(
        [np.stack([1 / z, zero, -x / z**2], -1), np.stack([zero, 1 / z, -y / z**2], -1)], -2
    )
    by_turn = cross(arms[:, :, None, :], by_point)  # d(w x a) . g = w . (a x g)
    J = np.concatenate([by_point, by_turn], -1).reshape(len(R), -1, 6)
    information = J.transpose(0, 2, 1) @ J
    return np.asarray(sigma**2 * np.linalg.inv(information))


def covariances(noise: PoseNoise, Ts_camera_target: Sequence[SE3], by_flange: Array) -> Array:
    """Covariances (N, 6, 6) of the residuals; `by_flange` (N, 6, 6) by a twist of the flange."""
    spread = np.repeat(noise.flange**2, 3)
    arm = (by_flange * spread) @ by_flange.transpose(0, 2, 1)
    return camera_covariances(noise.form, noise.camera, Ts_camera_target) + arm


def most_likely(
    noise: PoseNoise, Ts_camera_target: Sequence[SE3], residuals: Array, J: Array, by_flange: Array
) -> tuple[PoseNoise, float]:
    """The noise under which residuals (N, 6) with derivatives J (N, 6, P) are the most likely.

    Restricted maximum likelihood (Patterson and Thompson 1971); comes with minus twice its
    logarithm, the pull of what is expected of the flange contained.
    """
    count = len(noise.camera)
    low, high = np.log([*_LOWEST[noise.form], _LOWEST_FLANGE, _LOWEST_FLANGE]), np.log(_HIGHEST)

    def unpacked(x: Array) -> PoseNoise:
        s = np.exp(np.clip(x, low, high))
        return PoseNoise(noise.form, s[:count], s[count:])

    def objective(x: Array) -> float:
        V = covariances(unpacked(x), Ts_camera_target, by_flange)
        pull = ((x[count:] - np.log(_FLANGE)) / _WIDTH) ** 2
        outside = 1e3 * ((x - np.clip(x, low, high)) ** 2).sum()
        return _minus_twice_log(V, residuals, J) + float(pull.sum() + outside)

    start = noise.logs
    simplex = np.vstack([start, start + 0.7 * np.eye(len(start))])
    found = minimize(
        objective, start, method="Nelder-Mead",
        options={"xatol": 5e-2, "fatol": 5e-2, "maxfev": 200, "initial_simplex": simplex},
    )  # fmt: skip
    return unpacked(found.x), float(found.fun)


def _minus_twice_log(V: Array, residuals: Array, J: Array) -> float:
    sign, logs = np.linalg.slogdet(V)
    if not (sign > 0).all() or not np.isfinite(logs).all():
        return 1e12
    solved = np.linalg.solve(V, np.concatenate([J, residuals[:, :, None]], axis=2))
    H = np.einsum("nij,nik->jk", J, solved[:, :, :-1])
    b = np.einsum("nij,ni->j", J, solved[:, :, -1])
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    # what nothing tells gets a little stiffness, the same under every noise
    A = H / np.outer(scale, scale) + 1e-9 * np.eye(len(b))
    x = np.linalg.solve(A, b / scale)
    log_det = float(np.linalg.slogdet(A)[1] + 2 * np.log(scale).sum())
    square = float(np.einsum("ni,ni->", residuals, solved[:, :, -1]) - x @ (b / scale))
    return float(logs.sum()) + square + log_det
