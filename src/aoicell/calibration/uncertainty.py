"""How well everything is known: covariance, and what nothing tells.

The linear covariance is the inverse of the weighted normal matrix. It trusts the model; a
jackknife over views (each left out once; Efron 1982) asks the recording itself. Where the
views scatter more than the model says, the whole covariance is widened by that ratio.

What an arm does wrong alike in all views moves no predicted point: it goes into where the base
and the flange are said to be. With the joint angles known it is in the covariance, through the
priors of the joint terms. Without, no recording tells it, and it is assumed.
"""

from dataclasses import dataclass

import numpy as np

from aoicell.calibration.bundle import Solution
from aoicell.calibration.observability import Freedom, freedoms, inverse_of, natural_steps
from aoicell.calibration.parameters import DEFAULT_PRIOR, ArmPrior
from aoicell.transforms import Array

# An arm that nobody calibrated: it places its flange within some 3 mm, as published tests of
# pose accuracy (ISO 9283) usually find.
UNKNOWN_ARM = ArmPrior(joint_deg=0.1, origin_mm=0.6)
_WRIST = 0.2  # its length over the arm's reach
# Lengths, zero angles and axes of one arm are held by one factor on what was assumed of them,
# while each kind may be off by its own, some 1.8 times up or down (60 %, lognormal). What the
# recording tells of one kind is worth as much less for another: exp(0.6^2) in standard deviation.
# The factor is itself an estimate, good to some 20 %: intervals of 95 % hold, but beyond three
# standard deviations there is as much as in Student's t with about ten degrees of freedom.
_OTHER_KIND = float(np.exp(0.6**2))


@dataclass(frozen=True)
class Uncertainty:
    """Covariance (P, P) of all parameters, in the order and units of the layout's names.

    Poses as a twist (m, rad) in their own axes. `covariance` holds for work with this arm and
    this controller, `std` (P,) against the world: it contains `arm_std` (P,), what the arm's own
    inexactness moves alike in all views, and is NaN for what nothing tells. `from_prior` (P,) is
    the share of a parameter's variance that the recording left as the prior had it, 0 without a
    prior. `inflation` is how many times wider the views scatter than
    the model alone says, at least 1, and is contained in `covariance`.
    """

    names: tuple[str, ...]
    covariance: Array
    std: Array
    arm_std: Array
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
    arm_std = _arm_std(solution)
    return Uncertainty(
        layout.names, covariance, np.hypot(std, arm_std), arm_std, np.minimum(share, 1.0),
        inflation, freedoms(solution),
    )  # fmt: skip


def _arm_std(solution: Solution) -> Array:
    """Standard deviations (P,) of poses from what the arm does alike in all views.

    With joint terms: what their priors hold, less well than as if one factor held for all kinds,
    and where the last link ends, which is not among them. Without: the joints
    between the base and the wrist turn the base about the arm, at the length of its reach; those
    of the wrist turn the flange, at a fifth of it.
    """
    layout, problem, noise = solution.layout, solution.problem, solution.noise
    robot, std = layout.model.robot, np.zeros(layout.size)
    places = np.array([view.T_base_flange.translation for view in problem.views])
    reach = float(np.sqrt((places**2).sum(axis=1).mean()))
    if robot == "joint_terms":
        turn, origin = np.radians(DEFAULT_PRIOR.axis_deg), DEFAULT_PRIOR.origin_mm / 1e3
        factor = noise.arm_factor * _OTHER_KIND
        turns = {"base": 0.0, "flange": turn * factor}
        lengths = {"base": 0.0, "flange": origin * factor}
        std = _held_by_priors(solution)
    else:
        turn, origin = np.radians(UNKNOWN_ARM.joint_deg), UNKNOWN_ARM.origin_mm / 1e3
        lengths = {
            "base": np.hypot(np.sqrt(2) * reach * turn, np.sqrt(6) * origin),
            "flange": np.sqrt(3) * np.hypot(_WRIST * reach * turn, origin),
        }
        turns = dict.fromkeys(lengths, np.sqrt(3) * turn)
    for (kind, name), where in layout.blocks.items():
        if kind in ("eye", "fixture"):
            mount = (problem.eye if kind == "eye" else problem.fixture)(name).mount
            std[where] = np.hypot(std[where], [lengths[mount]] * 3 + [turns[mount]] * 3)
    return std


def _held_by_priors(solution: Solution) -> Array:
    """What the variances (P,) grow by, as a root, when the joint terms are held less well."""
    normal, layout = solution.normal, solution.layout
    step, joints = natural_steps(layout), layout.joints
    H, _ = normal.total()
    looser = H.copy()
    where = np.arange(layout.size)[joints]
    looser[where, where] -= normal.prior_information[joints] * (1 - _OTHER_KIND**-2)
    tight, loose = (np.diag(inverse_of(M, step)[0]) for M in (H, looser))
    return np.sqrt(np.maximum(loose - tight, 0.0))


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
