"""How noisy pixels and arm are, from the recording itself.

Restricted maximum likelihood (Patterson and Thompson 1971) of the pixel noise and of the
flange's deviations from view to view: a view's rows split into six that its deviation can
explain and the rest that it cannot. The rest tell the pixel noise, the six tell the arm's.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from aoicell.calibration.bundle import VIEW_LIMIT, Noise, Solution, outlier_weight
from aoicell.calibration.parameters import DEFAULT_PRIOR, ArmPrior, offset_from_prior
from aoicell.transforms import Array

# Limits of what can be: quantised pixels below, hopeless recordings above. The last is the
# factor on what was assumed of the arm's joint terms.
_FLOOR = np.log([3e-3, 1e-6, 1e-6, 1e-2])
_CEILING = np.log([50.0, 0.2, 0.2, 30.0])
_ROUNDS = 20
# The arm is expected within a factor of about ten of what was assumed; it matters only where
# few views say little.
_WIDTH = 2.0


@dataclass(frozen=True)
class _Compressed:
    """A linearised problem without its rows: what the likelihood needs of them.

    `tops` (views, 6, P + 1) and `factors` (views, 6, 6): the rows that the deviations can
    explain; `gram` (P + 1, P + 1): all of them; `rest`: the number of the others.
    """

    tops: Array
    factors: Array
    gram: Array
    rest: float
    view_weights: Array
    prior: Array
    prior_offset: Array
    joints: slice


def estimate_noise(solution: Solution, prior: ArmPrior = DEFAULT_PRIOR) -> Noise:
    """The noise under which what was seen is the most likely; keeps what the model has not.

    A view far outside the others' spread is given less weight and the rest asked again: the
    size of the others' deviations is not to be learnt from it.
    """
    packed = _compress(solution)
    noise = solution.noise
    count = {"exact": 1, "per_view": 3, "joint_terms": 4}[solution.layout.model.robot]
    values = np.array([noise.sigma, noise.deviation_m, noise.deviation_rad, noise.arm_factor])
    for _ in range(_ROUNDS):
        values[:count] = _most_likely(packed, values[:count], prior)
        if count == 1:
            break
        weights = _view_weights(packed, values[:count])
        if np.abs(np.log(weights / packed.view_weights)).max() < 0.2:
            break
        packed = replace(packed, view_weights=weights)
    return Noise(*(float(v) for v in values))


def _most_likely(packed: _Compressed, values: Array, prior: ArmPrior) -> Array:
    count = len(values)
    low, high = _FLOOR[:count], _CEILING[:count]
    expected = np.log([1.0, prior.deviation_mm / 1e3, np.radians(prior.deviation_deg), 1.0])

    def objective(x: Array) -> float:
        logs = np.clip(x, low, high)
        pull = ((logs - expected[:count])[1:] / _WIDTH) ** 2
        outside = ((x - logs) ** 2).sum() * 1e3
        return _minus_twice_log_likelihood(packed, np.exp(logs)) + float(pull.sum() + outside)

    start = np.clip(np.log(values), low, high)
    found = minimize(
        objective, start, method="Nelder-Mead",
        options={"xatol": 1e-2, "fatol": 1e-2, "maxfev": 400, "initial_simplex": _simplex(start)},
    )  # fmt: skip
    sigmas: Array = np.exp(np.clip(found.x, low, high))
    return sigmas


def _simplex(start: Array) -> Array:
    return np.vstack([start, start + 0.7 * np.eye(len(start))])


def _compress(solution: Solution) -> _Compressed:
    lin, normal = solution.lin, solution.normal
    root = np.sqrt(normal.row_weights)
    # residuals as they would be without the deviations
    without = lin.residuals.copy()
    for v, rows in enumerate(lin.rows):
        without[rows] += lin.J_view[rows] @ solution.estimate.deviations[v]
    rows_of = np.column_stack([lin.J, without]) * root[:, None]
    D = lin.J_view * root[:, None]
    deviates = solution.layout.model.robot != "exact"
    width, views = rows_of.shape[1], len(lin.rows)
    tops, factors = np.zeros((views, 6, width)), np.zeros((views, 6, 6))
    explained = 0
    for v, rows in enumerate(lin.rows):
        if deviates and D[rows].any():
            Q, R = np.linalg.qr(D[rows])
            k = Q.shape[1]
            tops[v, :k], factors[v, :k] = Q.T @ rows_of[rows], R
            explained += k
    # the square root of the weight stands for fewer rows where points are outliers
    count = float((normal.row_weights > 0.5).sum()) - explained
    return _Compressed(
        tops, factors, rows_of.T @ rows_of, max(count, 1.0), normal.view_weights,
        solution.layout.prior, offset_from_prior(solution.layout, solution.estimate),
        solution.layout.joints,
    )  # fmt: skip


@dataclass(frozen=True)
class _Weighted:
    """Normal equations A x = b of a compressed problem under a noise, and what goes with them.

    `V` (views, 6, 6): covariances of the tops; `rest`: the residuals' own square sum and the
    log determinants of all rows and priors.
    """

    A: Array
    b: Array
    V: Array
    rest: float


def _weighted(packed: _Compressed, sigmas: Array, view_weights: Array) -> _Weighted:
    width = len(packed.prior)
    variance = sigmas[0] ** 2
    M = packed.gram / variance
    rest = packed.rest * float(np.log(variance))
    prior, V = packed.prior, np.tile(variance * np.eye(6), (len(packed.tops), 1, 1))
    if len(sigmas) == 4:
        prior = np.array(prior)
        prior[packed.joints] *= sigmas[3]
        rest += 2 * float(np.log(sigmas[3])) * len(prior[packed.joints])
    if len(sigmas) >= 3:
        deviation = np.repeat(sigmas[1:3] ** 2, 3) / view_weights[:, None]
        F = packed.factors
        V = V + (F * deviation[:, None, :]) @ F.transpose(0, 2, 1)
        used = F.any(axis=(1, 2))
        rest += float(np.linalg.slogdet(V[used])[1].sum())
        solved = np.linalg.solve(V, packed.tops)
        tops = packed.tops.reshape(-1, width + 1)
        M = M - tops.T @ tops / variance + tops.T @ solved.reshape(-1, width + 1)
    A = M[:width, :width] + np.diag(1 / prior**2)
    b = M[:width, width] - packed.prior_offset / prior**2
    rest += float(M[width, width] + (packed.prior_offset**2 / prior**2).sum())
    return _Weighted(A, b, V, rest)


def _solved(weighted: _Weighted) -> tuple[Array, float]:
    """The solution of A x = b, and log det A up to a constant.

    What nothing tells gets a little stiffness, the same under every noise.
    """
    scale = np.sqrt(np.maximum(np.diag(weighted.A), 1e-300))
    A = weighted.A / np.outer(scale, scale) + 1e-10 * np.eye(len(scale))
    root = np.linalg.cholesky(A)
    half = np.linalg.solve(root, weighted.b / scale)
    x = np.linalg.solve(root.T, half) / scale
    return x, float(2 * np.log(np.diag(root)).sum() + 2 * np.log(scale).sum())


def _minus_twice_log_likelihood(packed: _Compressed, sigmas: Array) -> float:
    weighted = _weighted(packed, sigmas, packed.view_weights)
    x, log_det = _solved(weighted)
    return weighted.rest - float(x @ weighted.b) + log_det


def _view_weights(packed: _Compressed, sigmas: Array) -> Array:
    """Weights (views,) by how far a view's six rows lie outside their covariance."""
    x, _ = _solved(_weighted(packed, sigmas, packed.view_weights))
    plain = _weighted(packed, sigmas, np.ones(len(packed.tops)))
    r = packed.tops[:, :, -1] - packed.tops[:, :, :-1] @ x
    d2 = (r * np.linalg.solve(plain.V, r[:, :, None])[:, :, 0]).sum(axis=1)
    return outlier_weight(d2, VIEW_LIMIT)
