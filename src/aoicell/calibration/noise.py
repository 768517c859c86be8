"""How noisy pixels and arm are, from the recording itself.

Restricted maximum likelihood (Patterson and Thompson 1971) of the pixel noise and of the
flange's deviations from view to view: a view's rows split into six that its deviation can
explain and the rest that it cannot. The rest tell the pixel noise, the six tell the arm's.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import dtrtri
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
_STIFFNESS = 1e-10  # of what nothing tells, as a share of the diagonal


@dataclass(frozen=True)
class _Compressed:
    """A linearised problem without its rows: what the likelihood needs of them.

    `tops` (views, 6, P + 1) and `factors` (views, 6, 6): the rows that the deviations can
    explain, of the views that have any; `gram` (P + 1, P + 1): the others; `rest`: their number.
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
    free = {"exact": 1, "per_view": 3, "joint_terms": 4}[solution.layout.model.robot]
    values = np.array([noise.sigma, noise.deviation_m, noise.deviation_rad, noise.arm_factor])
    for _ in range(_ROUNDS):
        values = _most_likely(packed, values, free, prior)
        weights = _view_weights(packed, values)
        if np.abs(np.log(weights / packed.view_weights)).max(initial=0.0) < 0.2:
            break
        packed = replace(packed, view_weights=weights)
    return Noise(*(float(v) for v in values))


def _most_likely(packed: _Compressed, values: Array, free: int, prior: ArmPrior) -> Array:
    """Values (4,) of which the first `free` are the most likely and the others as they were."""
    expected = np.log([1.0, prior.deviation_mm / 1e3, np.radians(prior.deviation_deg), 1.0])
    width = np.array([np.inf, _WIDTH, _WIDTH, _WIDTH])  # nothing is expected of the pixels
    held = np.log(values[free:])
    # n numbers tell the logarithm of their sigma to 1 / sqrt(2 n): steps in that unit are alike
    views, terms = len(packed.tops), len(packed.prior[packed.joints])
    scale = 2 * np.sqrt(np.maximum([packed.rest, 3 * views, 3 * views, terms], 1.0))[:free]

    def objective(x: Array) -> tuple[float, Array]:
        logs = np.append(x / scale, held)
        pull = (logs - expected) / width
        value, slopes = _minus_twice_log_likelihood(packed, np.exp(logs))
        return value + float(pull @ pull), (slopes + 2 * pull / width)[:free] / scale

    low, high = scale * _FLOOR[:free], scale * _CEILING[:free]
    found = minimize(
        objective, np.clip(scale * np.log(values[:free]), low, high), jac=True,
        method="L-BFGS-B", bounds=np.column_stack([low, high]),
        options={"gtol": 3e-4, "ftol": 1e-12},
    )  # fmt: skip
    sigmas: Array = np.exp(np.append(found.x / scale, held))
    return sigmas


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
    used = [v for v, rows in enumerate(lin.rows) if deviates and D[rows].any()]
    tops, factors = np.zeros((len(used), 6, rows_of.shape[1])), np.zeros((len(used), 6, 6))
    explained = 0
    for top, factor, v in zip(tops, factors, used, strict=True):
        Q, R = np.linalg.qr(D[lin.rows[v]])
        k = Q.shape[1]
        top[:k], factor[:k] = Q.T @ rows_of[lin.rows[v]], R
        rows_of[lin.rows[v]] -= Q @ top[:k]
        explained += k
    # the square root of the weight stands for fewer rows where points are outliers
    count = float((normal.row_weights > 0.5).sum()) - explained
    return _Compressed(
        tops, factors, rows_of.T @ rows_of, max(count, 1.0), normal.view_weights[used],
        solution.layout.prior, offset_from_prior(solution.layout, solution.estimate),
        solution.layout.joints,
    )  # fmt: skip


def _summed(a: Array, b: Array) -> Array:
    """The sum over the views of a' b."""
    return np.asarray(a.reshape(-1, a.shape[-1]).T @ b.reshape(-1, b.shape[-1]))


def _covariances(packed: _Compressed, sigmas: Array, view_weights: Array) -> Array:
    """Those of the tops, (views, 6, 6)."""
    F, variances = packed.factors, _deviation_variances(sigmas, view_weights)
    of_deviations = (F * variances[:, None, :]) @ F.transpose(0, 2, 1)
    return np.asarray(sigmas[0] ** 2 * np.eye(6) + of_deviations)


def _deviation_variances(sigmas: Array, view_weights: Array) -> Array:
    """Those of the views' flange twists, (views, 6)."""
    return np.asarray(np.repeat(sigmas[1:3] ** 2, 3) / view_weights[:, None])


@dataclass(frozen=True)
class _Solved:
    """Normal equations A x = b of a compressed problem under a noise, and their solution.

    `tops` (views, 6, P + 1) and `whitener` (views, 6, 6): the tops with unit covariance, and what
    made them so; `prior` (P,): what it adds to the diagonal; `square_sum`: of the residuals that
    x leaves; `log_det`: of the tops' covariances and of A.
    """

    tops: Array
    whitener: Array
    prior: Array
    x: Array
    inverse: Array
    square_sum: float
    log_det: float


def _solved(packed: _Compressed, sigmas: Array, V: Array) -> _Solved:
    """Solve them; what nothing tells gets a little stiffness, the same under every noise."""
    roots = np.linalg.cholesky(V)
    whitener = np.linalg.inv(roots)
    tops = whitener @ packed.tops
    M = packed.gram / sigmas[0] ** 2 + _summed(tops, tops)
    prior = packed.prior**-2.0
    prior[packed.joints] /= sigmas[3] ** 2
    A = M[:-1, :-1] + np.diag(prior)
    b = M[:-1, -1] - prior * packed.prior_offset
    scale = np.sqrt(np.maximum(np.diag(A), 1e-300))
    root = np.linalg.cholesky(A / np.outer(scale, scale) + _STIFFNESS * np.eye(len(scale)))
    inverse_root = dtrtri(root, lower=1)[0] / scale
    half = inverse_root @ b
    square_sum = M[-1, -1] + prior @ packed.prior_offset**2 - half @ half
    log_det = np.log(np.diagonal(roots, axis1=1, axis2=2)).sum()
    log_det += np.log(np.diag(root) * scale).sum()
    return _Solved(
        tops, whitener, prior, inverse_root.T @ half, inverse_root.T @ inverse_root,
        float(square_sum), 2 * float(log_det),
    )  # fmt: skip


def _minus_twice_log_likelihood(packed: _Compressed, sigmas: Array) -> tuple[float, Array]:
    """It and its slopes (4,) by the logarithms of the sigmas.

    With M for all that is squared, over x and the residuals, and G = [A^-1 + x x', -x; -x', 1],
    any change has d(log det A + square sum) = tr(G dM) (Harville 1977, "Maximum likelihood
    approaches to variance component estimation").
    """
    V = _covariances(packed, sigmas, packed.view_weights)
    solved = _solved(packed, sigmas, V)
    offset, joints = packed.prior_offset, packed.joints
    logs = 2 * (packed.rest * np.log(sigmas[0]) + len(offset[joints]) * np.log(sigmas[3]))
    e = np.append(-solved.x, 1.0)
    G = np.outer(e, e)
    G[:-1, :-1] += solved.inverse
    G[np.diag_indices_from(G)] *= 1 + _STIFFNESS
    left = np.eye(6) - solved.tops @ G @ solved.tops.transpose(0, 2, 1)
    by_V = solved.whitener.transpose(0, 2, 1) @ left @ solved.whitener
    by_sigma = packed.rest - (G * packed.gram).sum() / sigmas[0] ** 2
    by_sigma += sigmas[0] ** 2 * np.trace(by_V, axis1=1, axis2=2).sum()
    variances = _deviation_variances(sigmas, packed.view_weights)
    by_axis = (variances * (packed.factors * (by_V @ packed.factors)).sum(axis=1)).sum(axis=0)
    told = np.diag(G)[:-1] + 2 * solved.x * offset + offset**2
    by_factor = (1 - solved.prior * told)[joints].sum()
    slopes = 2 * np.array([by_sigma, by_axis[:3].sum(), by_axis[3:].sum(), by_factor])
    return float(logs + solved.square_sum + solved.log_det), slopes


def _view_weights(packed: _Compressed, sigmas: Array) -> Array:
    """Weights (views,) by how far a view's six rows lie outside their covariance."""
    x = _solved(packed, sigmas, _covariances(packed, sigmas, packed.view_weights)).x
    plain = _covariances(packed, sigmas, np.ones(len(packed.tops)))
    r = packed.tops[:, :, -1] - packed.tops[:, :, :-1] @ x
    d2 = (r * np.linalg.solve(plain, r[:, :, None])[:, :, 0]).sum(axis=1)
    return outlier_weight(d2, VIEW_LIMIT)
