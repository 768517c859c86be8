"""What a correction leaves: how differently the camera will see the board, and how sure that is.

A left-over is a twist e (m, rad) of the board in the camera's axes: after the correction the
camera sees it at exp(e) T_camera_board instead of at the taught T_camera_board. The belief about
the left-overs of all views is one Gaussian: `first_look` makes it, and what is measured later
conditions it, as in a Kalman filter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, gammaincinv

from aoicell.calibration.cell_model import CellModel
from aoicell.transforms import Array


@dataclass(frozen=True)
class Drift:
    """How far the camera may creep after the board was taught (one sigma): on its mount, along
    and about each axis, and in its focal length (a lens that warms up by 5 K at 20 ppm/K).

    A mount that was knocked is no creep: the reference and the second look are to show it.
    """

    mm: float = 0.01
    deg: float = 0.001
    focal_ppm: float = 100.0

    @property
    def covariance(self) -> Array:
        """Of a twist of the camera in its own axes and the relative focal length, (7, 7)."""
        twist = [self.mm / 1e3] * 3 + [float(np.radians(self.deg))] * 3
        return np.diag(np.square([*twist, self.focal_ppm * 1e-6]))


def conditioned(
    mean: Array, covariance: Array, H: Array, z: Array, R: Array
) -> tuple[Array, Array, float]:
    """A normal belief after a measurement z = H x + noise of covariance R (Kalman 1960): mean,
    covariance, and the probability that z lies as far from what was expected as it does.
    """
    S = H @ covariance @ H.T + R
    innovation = z - H @ mean
    gain = np.linalg.solve(S, H @ covariance).T
    left = covariance - gain @ H @ covariance
    distance = float(innovation @ np.linalg.solve(S, innovation))
    return mean + gain @ innovation, (left + left.T) / 2, float(chdtrc(len(z), distance))


@dataclass(frozen=True)
class Leftover:
    """The belief about what is left at K views: `mean` (6K,) and `covariance` (6K, 6K).

    It covers what is systematic; each further arrival at a view adds its `arrival` (K, 6, 6).
    """

    mean: Array
    covariance: Array
    arrival: Array

    def of(self, view: int) -> Array:
        """Covariance (6, 6) of what one view will show when the arm goes there (again)."""
        rows = slice(6 * view, 6 * view + 6)
        return np.asarray(self.covariance[rows, rows] + self.arrival[view])

    def mean_of(self, view: int) -> Array:
        """The expected twist (6,) of one view."""
        return self.mean[6 * view : 6 * view + 6]

    def observed(self, H: Array, z: Array, R: Array) -> tuple["Leftover", float]:
        """The belief after a measurement z = H e + noise of covariance R, and the probability
        that z lies as far from what was expected as it does.
        """
        mean, covariance, probability = conditioned(self.mean, self.covariance, H, z, R)
        return replace(self, mean=mean, covariance=covariance), probability

    def only(self, views: Sequence[int]) -> "Leftover":
        """The belief about some of the views."""
        rows = np.concatenate([np.arange(6 * k, 6 * k + 6) for k in views])
        return Leftover(self.mean[rows], self.covariance[np.ix_(rows, rows)], self.arrival[views])

    def corrected(self) -> "Leftover":
        """The belief once the expected part has been taken out."""
        return replace(self, mean=np.zeros_like(self.mean))


@dataclass(frozen=True)
class Bound:
    """What a view's residual stays below: root mean square over its points, 95 % and 99.9 %."""

    mm_95: float
    mm_999: float
    px_95: float
    px_999: float


def bound_of(
    model: CellModel, covariance: Array, points: Array, levels: tuple[float, float] = (0.95, 0.999)
) -> Bound:
    """What the residual at points (N, 3) in the camera stays below, for a twist's covariance."""
    J_px, _ = model.pixel_derivatives(points)
    J_m = motion_of(points)
    mm = [1e3 * _quantile(covariance, J_m, len(points), level) for level in levels]
    px = [_quantile(covariance, J_px, len(points), level) for level in levels]
    return Bound(mm[0], mm[1], px[0], px[1])


def _quantile(covariance: Array, J: Array, count: int, level: float) -> float:
    """Of the root mean square of J e over the points, e normal with that covariance.

    A sum of weighted chi-squares, taken for a gamma variable of the same mean and variance
    (Satterthwaite 1946).
    """
    M = covariance @ (J.T @ J) / count
    mean, variance = float(np.trace(M)), 2 * float(np.trace(M @ M))
    return float(np.sqrt(gammaincinv(mean**2 / variance, level) * variance / mean))


def motion_of(points: Array) -> Array:
    """How points (N, 3) move with a small twist of all of them, (3N, 6)."""
    J = np.zeros((len(points), 3, 6))
    J[:, [0, 1, 2], [0, 1, 2]] = 1
    x, y, z = points.T
    J[:, 0, 4], J[:, 0, 5] = z, -y
    J[:, 1, 3], J[:, 1, 5] = -z, x
    J[:, 2, 3], J[:, 2, 4] = y, -x
    return J.reshape(-1, 6)


def rms_of(twist: Array, points: Array) -> float:
    """Root mean square (m) of how far a twist (6,) moves points (N, 3)."""
    return float(np.linalg.norm(motion_of(points) @ twist) / np.sqrt(len(points)))
