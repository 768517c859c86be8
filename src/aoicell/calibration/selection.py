"""Which model explains a recording, judged on views that it has not seen.

A richer model always leaves smaller residuals, so residuals decide nothing. The views are cut
into folds; each fold's points are predicted from a fit to the others, with the arm where its
controller has it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.calibration.bundle import Noise, Solution, refine
from aoicell.calibration.measurement import POSE_UNIT, chain, linearise
from aoicell.calibration.noise import estimate_noise
from aoicell.calibration.observability import natural_steps, root_of_inverse
from aoicell.calibration.parameters import (
    DEFAULT_PRIOR,
    LENSES,
    ArmPrior,
    Estimate,
    Lens,
    Model,
    RobotModel,
    conform,
    layout_of,
    retract,
)
from aoicell.calibration.problem import CalibrationView, Mask, Problem, Sight
from aoicell.errors import Implausible
from aoicell.transforms import Array

_ROUNDS = 4  # of refinement and noise; two are the rule
_FOLDS = 6


@dataclass(frozen=True)
class HeldOut:
    """How well a model predicts each view from the others.

    `px` (views,): root mean square error over the view's points, NaN where eyes report poses;
    `mm` (views,): the same across the line of sight, or of the reported origin. `score`
    (views,): log density of what was seen under the prediction and its covariance, the arm's
    deviation included. Models are compared by it: a wrong lens bends the board in the picture
    by less than the arm's deviation moves it, but no deviation of an arm bends it.
    """

    px: Array
    mm: Array
    score: Array

    @property
    def error(self) -> Array:
        """Errors by view, in px, or in mm where there are no pixels."""
        return self.mm if np.isnan(self.px).all() else self.px


@dataclass(frozen=True)
class Candidate:
    """A model with its fit and its held-out errors."""

    model: Model
    solution: Solution
    held_out: HeldOut


def fit(
    problem: Problem, model: Model, start: Estimate, noise: Noise, prior: ArmPrior = DEFAULT_PRIOR
) -> Solution:
    """Refines and estimates the noise in turn until both stand."""
    layout = layout_of(problem, model, prior)
    estimate = conform(problem, model, start)
    # at least as much noise as the start leaves, or each point would pass for an outlier
    left = np.abs(linearise(problem, layout, estimate, derivatives=False).residuals)
    noise = replace(noise, sigma=max(noise.sigma, 1.5 * float(np.median(left))))
    for _ in range(_ROUNDS):
        solution = refine(problem, layout, estimate, noise, 6, 1e-2)
        estimate, before = solution.estimate, noise
        noise = estimate_noise(solution, prior)
        if abs(np.log(noise.sigma / before.sigma)) < 0.02 and _same_arm(noise, before):
            break
    return refine(problem, layout, estimate, noise)


def _same_arm(a: Noise, b: Noise) -> bool:
    ratios = [
        a.deviation_m / b.deviation_m,
        a.deviation_rad / b.deviation_rad,
        a.arm_factor / b.arm_factor,
    ]
    return bool(np.abs(np.log(ratios)).max() < 0.1)


def hold_out(solution: Solution, refit: bool = False, folds: int = _FOLDS) -> HeldOut:
    """Each fold of views predicted from a fit to the others, begun at the fit to all.

    One Newton step makes that fit, from the normal equations at hand less the fold's; with
    `refit` it is iterated to the end, which takes longer and changes little.
    """
    problem, normal = solution.problem, solution.normal
    count = len(problem.views)
    px, mm, score = np.full(count, np.nan), np.full(count, np.nan), np.full(count, np.nan)
    for fold in range(min(folds, count)):
        out = np.arange(count) % min(folds, count) == fold
        H, b = normal.total(np.flatnonzero(~out))
        root, _ = root_of_inverse(H, natural_steps(solution.layout))
        step = root @ (root.T @ b)
        deviations = solution.estimate.deviations + normal.back_rhs - normal.back @ step
        fitted = retract(solution.layout, solution.estimate, step, deviations)
        if refit:
            rest = problem.with_views([v for v, o in zip(problem.views, out, strict=True) if not o])
            start = replace(fitted, deviations=deviations[~out])
            try:
                fitted = refine(rest, solution.layout, start, solution.noise, 12, 1e-2).estimate
            except Implausible:  # so far from all others that the step itself is nonsense
                px[out], mm[out], score[out] = np.inf, np.inf, -np.inf
                continue
        for v in np.flatnonzero(out):
            view, weights = problem.views[v], normal.row_weights[solution.lin.rows[v]]
            r = predicted_residuals(solution, fitted, view, view)
            px[v], mm[v] = errors_of(solution, fitted, view, r, weights > 0.5)
            score[v] = _log_density(solution, int(v), r, root)
    return HeldOut(px, mm, score)


def predicted_residuals(
    solution: Solution, estimate: Estimate, seen: CalibrationView, at: CalibrationView
) -> Array:
    """Residuals (rows,) of a view's sights, with the arm where its controller has it in `at`.

    Infinite where points would lie behind the camera.
    """
    there = replace(seen, T_base_flange=at.T_base_flange, q=at.q)
    problem = solution.problem.with_views([there])
    still = replace(estimate, deviations=np.zeros((1, 6)))
    lin = linearise(problem, solution.layout, still, derivatives=False)
    return lin.residuals if lin.in_front else np.full(len(lin.residuals), np.inf)


def errors_of(
    solution: Solution, estimate: Estimate, view: CalibrationView, r: Array, trusted: Mask
) -> tuple[float, float]:
    """Root mean squares (px, mm) of a view's residuals over the rows of a mask."""
    if not np.isfinite(r).all() or not len(r):
        return np.inf, np.inf
    if solution.problem.of_poses:
        gaps = r.reshape(-1, 6)[:, :3] * POSE_UNIT[:3]
        return np.nan, float(np.sqrt((gaps**2).sum(axis=1).mean())) * 1e3
    trusted = trusted if trusted.any() else ~trusted
    sizes = [2 * len(sight.ids) for sight in view.sights if isinstance(sight, Sight)]
    metres = np.repeat(_metres_per_pixel(solution.problem, estimate, view), sizes)
    squares = r[trusted] ** 2
    return (
        float(np.sqrt(2 * squares.mean())),
        float(np.sqrt(2 * (squares * metres[trusted] ** 2).mean())) * 1e3,
    )


def _log_density(solution: Solution, view: int, r: Array, root: Array) -> float:
    """Of residuals with covariance sigma^2 + L L': L from the parameters and the deviation.

    Robust weights widen a row, on both sides: what moves all points alike moves outliers too.
    """
    if not np.isfinite(r).all():
        return -np.inf
    rows, variance = solution.lin.rows[view], solution.noise.sigma**2
    L = solution.lin.J[rows] @ root
    if solution.layout.model.robot != "exact":
        L = np.hstack([L, solution.lin.J_view[rows] * solution.noise.deviation])
    weights = np.sqrt(solution.normal.row_weights[rows])
    L, r = L * weights[:, None], r * weights
    S = np.eye(L.shape[1]) + L.T @ L / variance
    along = np.linalg.solve(np.linalg.cholesky(S), L.T @ r) / variance
    log_det = len(r) * np.log(variance) + np.linalg.slogdet(S)[1]
    return float(-0.5 * (r @ r / variance - along @ along + log_det))


def _metres_per_pixel(problem: Problem, estimate: Estimate, view: CalibrationView) -> Array:
    """Of each sight of a view, at the middle of the fixture."""
    scales = []
    for sight in view.sights:
        link = chain(problem, estimate, sight.eye, sight.fixture, view.T_base_flange)
        centre = problem.fixture(sight.fixture).points.mean(axis=0)
        depth = link.T_camera_fixture.act(centre)[2]
        scales.append(depth / estimate.cameras[sight.eye].focal_px)
    return np.array(scales)


def better(rich: HeldOut, simple: HeldOut, views: Mask, sure: float = 1.0) -> bool:
    """Whether one model gives what was seen more density than another, over a mask of views.

    Paired: the mean gain in score against `sure` times its standard error.
    """
    known = views & np.isfinite(rich.score) & np.isfinite(simple.score)
    return _gains(rich.score[known] - simple.score[known], sure, 0.05)


def closer(one: HeldOut, other: HeldOut, views: Mask, sure: float = 1.0) -> bool:
    """Whether one model predicts nearer than another: by the logarithms of the errors."""
    known = views & np.isfinite(one.error) & np.isfinite(other.error)
    return _gains(np.log(other.error[known] / one.error[known]), sure, 0.01)


def _gains(gain: Array, sure: float, least: float) -> bool:
    if len(gain) < 3:
        return False
    return bool(gain.mean() > max(sure * gain.std(ddof=1) / np.sqrt(len(gain)), least))


def select(
    problem: Problem,
    start: Estimate,
    noise: Noise,
    lenses: Sequence[Lens] = tuple(LENSES),
    robots: Sequence[RobotModel] = ("joint_terms", "per_view", "exact"),
    prior: ArmPrior = DEFAULT_PRIOR,
) -> tuple[Candidate, list[Candidate]]:
    """The model that predicts best, and all that were tried.

    The robot first, by the distance of prediction: every arm has its errors and deviates a little
    from view to view, so the first of `robots` stands unless another comes closer, and an exact
    arm, beside which all error is the picture's, has to come much closer. Then the lens, by score,
    from simple to rich: the simpler one stands unless the richer is surely better. Both may be
    cut down to one. Raises Implausible when no fit stands.
    """
    free = tuple(f.name for f in problem.fixtures if f.scale == "free")
    refined = any(e.refine and e.camera for e in problem.eyes)
    lenses = tuple(lenses) if refined else ("none",)
    if problem.of_poses:
        robots = ["exact"]  # what an eye reports and where the arm stood cannot be told apart
    elif not problem.has_joints:
        robots = [r for r in robots if r != "joint_terms"] or ["per_view"]
    # far from the truth the rich but tame lens is the safest to begin with
    first: Lens = "k1k2p1p2" if "k1k2p1p2" in lenses else lenses[-1]
    best = _attempt(problem, Model(first, robots[0], free), start, noise, prior)
    tried = [best]
    begin, trusted = best.solution, best.solution.normal.view_weights > 0.5
    for robot in robots[1:]:
        candidate = _tried(begin, Model(first, robot, free), prior, tried)
        sure = 3.0 if robot == "exact" else 1.0
        if candidate and closer(candidate.held_out, best.held_out, trusted, sure):
            best = candidate
    begin, by_lens = best.solution, {first: best}
    for lens in lenses:
        if lens != first:
            candidate = _tried(begin, replace(best.model, lens=lens), prior, tried)
            if candidate:
                by_lens[lens] = candidate
    best = by_lens[next(lens for lens in lenses if lens in by_lens)]
    for lens in lenses:
        candidate = by_lens.get(lens)
        if candidate and better(candidate.held_out, best.held_out, trusted):
            best = candidate
    return best, tried


def _attempt(
    problem: Problem, model: Model, start: Estimate, noise: Noise, prior: ArmPrior
) -> Candidate:
    solution = fit(problem, model, start, noise, prior)
    return Candidate(model, solution, hold_out(solution))


def _tried(
    begin: Solution, model: Model, prior: ArmPrior, tried: list[Candidate]
) -> Candidate | None:
    """An attempt from another model's fit; None, and not on the list, where it fails."""
    try:
        found = _attempt(begin.problem, model, begin.estimate, begin.noise, prior)
    except Implausible:
        return None
    tried.append(found)
    return found
