"""How well everything is known: covariance, and what nothing tells.

The linear covariance is the inverse of the weighted normal matrix. It trusts the model; a
jackknife over views (each left out once; Efron 1982) asks the recording itself. Where the
views scatter more than the model says, the whole covariance is widened by that ratio.
"""

from dataclasses import dataclass

import numpy as np

from aoicell.calibration.bundle import Solution
from aoicell.calibration.observability import Freedom, freedoms, inverse_of, natural_steps
from aoicell.transforms import Array


@dataclass(frozen=True)
class Uncertainty:
    """Covariance (P, P) of all parameters, in the order and units of the layout's names.

    Poses as a twist (m, rad) in their own axes. `std` (P,) is NaN for what nothing tells;
    `from_prior` (P,) is the share of a parameter's variance that the recording left as the
    prior had it, 0 without a prior. `inflation` is how many times wider the views scatter than
    the model alone says, at least 1, and is contained in `covariance`.
    """

    names: tuple[str, ...]
    covariance: Array
    std: Array
    from_prior: Array
    inflation: float
    unobservable: tuple[Freedom, ...]


def uncertainty_of(solution: Solution) -> Uncertainty:
    """Covariance of a solution, widened by what the views say among themselves."""
    normal, layout = solution.normal, solution.layout
    H, _ = normal.total()
    step = natural_steps(layout)
    covariance, lost = inverse_of(H, step)
    inflation = _inflation(solution, H, step)
    covariance = covariance * inflation**2
    std = np.sqrt(np.diag(covariance))
    std[lost] = np.nan
    prior = solution.noise.prior(layout)
    with np.errstate(invalid="ignore"):
        share = np.where(np.isfinite(prior), (std / inflation / prior) ** 2, 0.0)
    return Uncertainty(
        layout.names, covariance, std, np.minimum(share, 1.0), inflation, freedoms(solution)
    )


def _inflation(solution: Solution, H: Array, step: Array) -> float:
    """Root of the views' variance over the model's, in the mean over what the recording tells.

    With g_v the gradient of view v, g_v' (H - H_v)^-1 g_v is, in the mean and under the model,
    its share tr(H^-1 H_v) of what is told: the jackknife's step times the first-order one, which
    takes the bias from both (HC2 of MacKinnon and White 1985, with views for clusters).
    """
    normal = solution.normal
    covariance, _ = inverse_of(H, step)
    told = float(np.trace(covariance @ normal.information.sum(axis=0)))
    if len(normal.gradient) < 3 or told < 1:
        return 1.0
    spread = 0.0
    for information, gradient in zip(normal.information, normal.gradient, strict=True):
        inverse, _ = inverse_of(H - information, step)
        spread += float(gradient @ inverse @ gradient)
    few = _few_views(solution, covariance, told)
    return float(np.sqrt(max(1.0, spread / told) * few))


def _few_views(solution: Solution, covariance: Array, told: float) -> float:
    """How much wider a variance is whose own size had to be learnt from few views.

    The arm's deviations are estimated from six numbers a view less those that the parameters
    took; with that many views left, nu, what rests on them is spread as Student's t and has
    nu / (nu - 2) times the variance. What rests on pixels is not: their noise is well known.
    """
    if solution.layout.model.robot == "exact":
        return 1.0
    root = np.sqrt(solution.normal.row_weights) / solution.noise.sigma
    J = solution.lin.J * root[:, None]
    prior = np.diag(solution.normal.prior_information)
    by_pixels, _ = inverse_of(J.T @ J + prior, natural_steps(solution.layout))
    information = solution.normal.information.sum(axis=0)
    share = 1 - float(np.trace(by_pixels @ information)) / told
    nu = max(len(solution.normal.gradient) - told / 6, 3.0)
    return 1 + max(share, 0.0) * 2 / (nu - 2)
