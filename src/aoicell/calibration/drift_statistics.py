"""The statistics of a drift check: which change of an old calibration new views speak for.

Linearised at the old calibration, the whitened residuals of the new views are
y = W (e + D) + n: W the derivatives, e what the old estimate was off (covariance C), D what has
changed since, n unit noise. So y has the covariance V = I + W C W', and whether a group of
parameters changed is a generalised least squares test: the chi-square that its columns of W
take from y, after what may have changed anyway (where the target lies) has been taken away.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtrc

from aoicell.calibration.measurement import Linearisation
from aoicell.transforms import Array

_RANK = 1e-9  # singular values below this share of the largest are rounding errors


@dataclass(frozen=True)
class Whitened:
    """Residuals and derivatives of unit noise, rotated to as few rows as there are parameters.

    `y` (K,), `W` (K, P); `left` is the chi-square of the `freedoms` rows that no parameter can
    explain. `pixels_left`, `pixel_freedoms`: the same of the rows that no flange can explain
    either; the difference is by how much the views' flanges disagree.
    """

    y: Array
    W: Array
    left: float
    freedoms: int
    pixels_left: float
    pixel_freedoms: int


@dataclass(frozen=True)
class ChangeTest:
    """A change of one group of parameters, as the views see it.

    `chi_square` has `freedoms` degrees of freedom if nothing changed, `p` is how often it is as
    large by chance. `values` (k,) is the change in the units of the group's directions, with its
    covariance (k, k); directions that nothing tells are missing from `freedoms`.
    """

    name: str
    chi_square: float
    freedoms: int
    p: float
    values: Array
    covariance: Array

    @property
    def complete(self) -> bool:
        """Whether the views tell the whole change."""
        return self.freedoms == len(self.values)


def whiten(lin: Linearisation, sigma: float, deviation: Array, step: Array) -> Whitened:
    """Rows of unit noise; `deviation` (6,) are standard deviations of each view's flange twist.

    The rows of a view split into six that a deviation of its flange moves and the rest that it
    does not move, as for the noise of a calibration. `step` (P,) is a natural step of each
    parameter, for the ranks.
    """
    tops, rests = [], []
    for rows in lin.rows:
        M = np.column_stack([lin.J[rows], lin.residuals[rows]]) / sigma
        Q, R = np.linalg.qr(lin.J_view[rows], mode="complete")
        turned, R = Q.T @ M, R[:6] * deviation / sigma
        tops.append(np.linalg.solve(np.linalg.cholesky(np.eye(6) + R @ R.T), turned[:6]))
        rests.append(turned[6:])
    rest = np.vstack(rests)
    everything = np.vstack([*tops, rest])
    left, freedoms = _left_over(everything, step)
    pixels_left, pixel_freedoms = _left_over(rest, step)
    _, R_all = np.linalg.qr(everything)
    triangle: Array = R_all[: len(step)]
    return Whitened(triangle[:, -1], triangle[:, :-1], left, freedoms, pixels_left, pixel_freedoms)


def _left_over(rows: Array, step: Array) -> tuple[float, int]:
    """Chi-square of rows (N, P + 1) that all parameters leave, and its degrees of freedom."""
    basis = _basis(rows[:, :-1] * step)
    y = rows[:, -1]
    return float(y @ y - ((basis.T @ y) ** 2).sum()), len(y) - basis.shape[1]


def _basis(columns: Array) -> Array:
    """Orthonormal basis (N, rank) of what columns (N, k) span."""
    U, s, _ = np.linalg.svd(columns, full_matrices=False)
    rank = int((s > _RANK * s[0]).sum()) if len(s) and s[0] > 0 else 0
    return U[:, :rank]


def tail(chi_square: float, freedoms: int, noise_freedoms: float) -> float:
    """How often chance alone is as large, the noise known from `noise_freedoms` numbers."""
    if freedoms == 0:
        return 1.0
    chi_square = max(chi_square, 0.0)  # what a fit leaves of almost nothing may round below it
    if np.isinf(noise_freedoms):
        return float(chdtrc(freedoms, chi_square))
    return float(fdtrc(freedoms, noise_freedoms, chi_square / freedoms))


@dataclass(frozen=True)
class DriftModel:
    """Whitened views with the old calibration's own uncertainty, ready for tests.

    `y` (K,) and `W` (K, P) have unit covariance if nothing changed but `nuisance` (P, n), the
    directions that may have.
    """

    y: Array
    W: Array
    nuisance: Array
    step: Array
    noise_freedoms: float

    @classmethod
    def of(
        cls, views: Whitened, offset: Array, covariance: Array, nuisance: Array, step: Array,
        noise_freedoms: float,
    ) -> "DriftModel":  # fmt: skip
        """`offset` (P,) leads from the old calibration to where the views were linearised."""
        y, W = views.y + views.W @ offset, views.W
        root = np.linalg.cholesky(np.eye(len(y)) + W @ covariance @ W.T)
        solved = np.linalg.solve(root, np.column_stack([W, y]))
        return cls(solved[:, -1], solved[:, :-1], nuisance, step, noise_freedoms)

    def test(self, name: str, directions: Array, scale: Array) -> ChangeTest:
        """Test of a change along directions (P, k), one natural step of each being `scale` (k,)."""
        free = _basis(self.W @ self.nuisance) if self.nuisance.shape[1] else np.zeros((0, 0))
        y, G = self.y, self.W @ directions * scale
        if free.size:
            y, G = y - free @ (free.T @ y), G - free @ (free.T @ G)
        size = np.linalg.norm(self.W @ directions * scale, axis=0).max(initial=0.0)
        U, s, Vt = np.linalg.svd(G, full_matrices=False)
        told = s > max(_RANK * size, 1e-12)
        U, s, Vt = U[:, told], s[told], Vt[told]
        along = U.T @ y
        chi_square, freedoms = float(along @ along), int(told.sum())
        back = Vt.T * scale[:, None] / s
        p = tail(chi_square, freedoms, self.noise_freedoms)
        return ChangeTest(name, chi_square, freedoms, p, back @ along, back @ back.T)

    def nuisance_values(self, directions: Array, values: Array) -> Array:
        """What the nuisance directions take (n,), given a change of `values` along directions."""
        N = self.W @ self.nuisance
        y = self.y - self.W @ directions @ values
        return np.asarray(np.linalg.lstsq(N, y, rcond=None)[0])


def columns(size: int, indices: Sequence[int]) -> Array:
    """Unit directions (P, k) of single parameters."""
    return np.eye(size)[:, list(indices)]
