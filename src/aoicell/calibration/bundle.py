"""The joint refinement: all sights of all views, robustly weighted, in one least squares.

Minimised over the parameters g of a layout and the deviations d_v of the views (Triggs et al.
2000, "Bundle adjustment: a modern synthesis"):

    sum_points rho(|r|^2 / sigma^2) + sum_views rho(d_v' S^-1 d_v) + sum (g - g_prior)^2 / s^2

With d_v eliminated view by view (Schur complement) this is the fit in which a view counts by
the pixel noise and by what the arm's repeatability makes of it, J S J': points of one view move
together and are not as many independent measurements.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from aoicell.calibration.measurement import Linearisation, linearise
from aoicell.calibration.parameters import Estimate, Layout, offset_from_prior, retract
from aoicell.calibration.problem import Indices, Problem
from aoicell.errors import Implausible
from aoicell.transforms import Array

# Squared distances beyond which a point, a pose or a view is taken for an outlier: one in 500
# of good ones. Beyond, the loss grows like a logarithm, the influence falls like 1 / distance.
_TAIL = 2e-3
_POINT_LIMIT, VIEW_LIMIT = float(chdtri(2, _TAIL)), float(chdtri(6, _TAIL))


@dataclass(frozen=True)
class Noise:
    """One standard deviation of a pixel coordinate (px; or POSE_UNIT) and of a view's flange.

    `deviation_m` and `deviation_rad` hold for each axis. `arm_factor` multiplies the standard
    deviations that were assumed of the arm's joint terms.
    """

    sigma: float
    deviation_m: float
    deviation_rad: float
    arm_factor: float = 1.0

    @property
    def deviation(self) -> Array:
        """Standard deviations (6,) of a flange twist."""
        return np.array([self.deviation_m] * 3 + [self.deviation_rad] * 3)

    def prior(self, layout: Layout) -> Array:
        """Standard deviations (P,) of the parameters' priors."""
        prior = np.array(layout.prior)
        prior[layout.joints] *= self.arm_factor
        return prior


@dataclass(frozen=True)
class Normal:
    """The normal equations at an estimate, the deviations eliminated.

    `information` (views, P, P) and `gradient` (views, P) add up over the views; the prior is
    `prior_information` (P,) and `prior_gradient` (P,). `back` and `back_rhs` give the
    deviations' step: back_rhs - back @ step. `row_weights` (R,) and `view_weights` (views,)
    are the robust weights, 1 for what is trusted.
    """

    information: Array
    gradient: Array
    prior_information: Array
    prior_gradient: Array
    back: Array
    back_rhs: Array
    row_weights: Array
    view_weights: Array

    def total(self, views: Indices | None = None) -> tuple[Array, Array]:
        """Normal matrix and right-hand side with the prior, over some views or all."""
        chosen = slice(None) if views is None else views
        H = self.information[chosen].sum(axis=0) + np.diag(self.prior_information)
        return H, self.gradient[chosen].sum(axis=0) + self.prior_gradient


@dataclass(frozen=True)
class Solution:
    """A converged refinement with the equations it ended in."""

    problem: Problem
    layout: Layout
    noise: Noise
    estimate: Estimate
    lin: Linearisation
    normal: Normal
    cost: float
    iterations: int


def refine(
    problem: Problem, layout: Layout, start: Estimate, noise: Noise,
    max_iterations: int = 40, tolerance: float = 1e-4,
) -> Solution:  # fmt: skip
    """Levenberg-Marquardt from a start near enough, until a step gains less than `tolerance`.

    The cost is a chi-square: a gain of 1e-4 is a hundredth of one standard deviation.

    Raises Implausible when the start puts points behind a camera or nothing is finite.
    """
    estimate = start
    lin = linearise(problem, layout, estimate)
    cost = _cost(layout, estimate, lin, noise)
    if not np.isfinite(cost):
        raise Implausible(
            "refinement: the start puts points of a target behind the camera; check the mount, "
            "the direction of the poses and the order of the points"
        )
    damping, iteration = 1e-6, 0
    normal = normal_equations(layout, estimate, lin, noise)
    for iteration in range(1, max_iterations + 1):  # noqa: B007 - counted for the result
        improved = False
        while damping < 1e8:
            trial = _step(layout, estimate, normal, damping)
            trial_lin = linearise(problem, layout, trial, derivatives=False)
            trial_cost = _cost(layout, trial, trial_lin, noise)
            if trial_cost < cost:
                improved = True
                break
            damping = max(damping, 1e-7) * 8
        if not improved:
            break
        gain, cost, estimate = cost - trial_cost, trial_cost, trial
        damping = max(damping / 8, 1e-9)
        lin = linearise(problem, layout, estimate)
        normal = normal_equations(layout, estimate, lin, noise)
        if gain < tolerance:
            break
    return Solution(problem, layout, noise, estimate, lin, normal, cost, iteration)


def group_sizes(lin: Linearisation) -> tuple[Indices, Indices]:
    """First row and number of rows of each point or pose."""
    first = np.flatnonzero(np.diff(lin.groups, prepend=-1))
    return first, np.diff(first, append=len(lin.groups))


def _distances(lin: Linearisation, noise: Noise) -> tuple[Array, Array, Indices]:
    """Squared distances of points or poses, their limits, and their numbers of rows."""
    first, sizes = group_sizes(lin)
    d2 = np.add.reduceat((lin.residuals / noise.sigma) ** 2, first) if len(first) else np.zeros(0)
    return d2, np.where(sizes == 2, _POINT_LIMIT, VIEW_LIMIT), sizes


def _rho(d2: Array, limit: Array | float) -> Array:
    return np.where(d2 <= limit, d2, limit * (1 + np.log(np.maximum(d2, limit) / limit)))


def outlier_weight(d2: Array, limit: Array | float) -> Array:
    """1 up to a limit of the squared distance, limit / distance beyond."""
    return np.where(d2 <= limit, 1.0, limit / np.maximum(d2, limit))


def _view_distances(estimate: Estimate, noise: Noise) -> Array:
    return np.asarray(((estimate.deviations / noise.deviation) ** 2).sum(axis=1))


def _cost(layout: Layout, estimate: Estimate, lin: Linearisation, noise: Noise) -> float:
    if not lin.in_front or not np.isfinite(lin.residuals).all():
        return np.inf
    d2, limits, _ = _distances(lin, noise)
    prior = offset_from_prior(layout, estimate) / noise.prior(layout)
    views = _rho(_view_distances(estimate, noise), VIEW_LIMIT)
    return float(_rho(d2, limits).sum() + views.sum() + (prior**2).sum())


def normal_equations(
    layout: Layout, estimate: Estimate, lin: Linearisation, noise: Noise
) -> Normal:
    """The normal equations at an estimate, with the robust weights that hold there."""
    d2, limits, sizes = _distances(lin, noise)
    row_weights = np.repeat(outlier_weight(d2, limits), sizes)
    view_weights = outlier_weight(_view_distances(estimate, noise), VIEW_LIMIT)
    root = np.sqrt(row_weights) / noise.sigma
    J, J_view, r = lin.J * root[:, None], lin.J_view * root[:, None], lin.residuals * root
    count, width = len(lin.rows), layout.size
    H, b = np.zeros((count, width, width)), np.zeros((count, width))
    back, back_rhs = np.zeros((count, 6, width)), np.zeros((count, 6))
    deviates = layout.model.robot != "exact"
    for v, rows in enumerate(lin.rows):
        J_v, r_v = J[rows], r[rows]
        H[v], b[v] = J_v.T @ J_v, J_v.T @ r_v
        if not deviates:
            continue
        D = J_view[rows]
        stiffness = view_weights[v] / noise.deviation**2
        coupling = D.T @ J_v
        rhs = D.T @ r_v - stiffness * estimate.deviations[v]
        solved = np.linalg.solve(D.T @ D + np.diag(stiffness), np.column_stack([coupling, rhs]))
        back[v], back_rhs[v] = solved[:, :-1], solved[:, -1]
        H[v] -= coupling.T @ back[v]
        b[v] -= coupling.T @ back_rhs[v]
    prior = 1 / noise.prior(layout) ** 2
    offset = -prior * offset_from_prior(layout, estimate)
    return Normal(H, b, prior, offset, back, back_rhs, row_weights, view_weights)


def _step(layout: Layout, estimate: Estimate, normal: Normal, damping: float) -> Estimate:
    H, b = normal.total()
    scale = np.sqrt(np.maximum(np.diag(H), 1e-12 * np.diag(H).max() + 1e-300))
    scaled = H / np.outer(scale, scale) + damping * np.eye(len(b))
    step = np.linalg.solve(scaled, b / scale) / scale
    deviations = estimate.deviations + normal.back_rhs - normal.back @ step
    return retract(layout, estimate, step, deviations)
