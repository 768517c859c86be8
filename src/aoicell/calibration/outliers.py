"""Views that do not fit, each held against what a fit to the others predicts of it.

A good view far from the others is predicted badly too, and six views always have one that is.
So its error is not compared with theirs but with its own covariance: lens, hand-eye and arm as
the others leave them, and the noise. Few views hide an outlier in the noise that they are asked
about, so that noise is estimated without it as well.

Where several are suspected, the others are fitted first and each suspect that fits them is taken
back, the best one first: the forward search (Hadi 1992, "Identifying multiple outliers in
multivariate data").
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from aoicell.calibration.bundle import Solution
from aoicell.calibration.measurement import linearise
from aoicell.calibration.motion import DEFAULT_MOTION, MotionLimits, examine_motion
from aoicell.calibration.parameters import DEFAULT_PRIOR, ArmPrior
from aoicell.calibration.problem import CalibrationView, Mask, Problem, moves, pairs_seen
from aoicell.calibration.selection import Candidate, fit
from aoicell.calibration.starts import SightPoses
from aoicell.calibration.uncertainty import Uncertainty, uncertainty_of
from aoicell.errors import Implausible
from aoicell.transforms import Array

# Views are suspected whose held-out error is so many times the usual one, or whose deviation
# the fit itself has as good as given up.
_SUSPECT_RATIO, _GIVEN_UP = 5.0, 0.25
# A view is out where a good one would be as far off once in so many: well beyond what the number
# of views asks for, as an arm's deviations have longer tails than a normal distribution.
_TAIL = 1e-6
# Up to so many views each is left out in turn; more of them know their noise without that.
_FEW = 12


def outliers(
    candidate: Candidate, poses: SightPoses, limits: MotionLimits = DEFAULT_MOTION,
    prior: ArmPrior = DEFAULT_PRIOR,
) -> Mask:  # fmt: skip
    """Views (boolean mask) that do not fit what the others say.

    `poses` are those of the candidate's sights. A view without which the others would not tell
    the hand-eye is judged by its held-out error alone.
    """
    trial = _Trial(candidate, poses, limits, prior)
    out = trial.taken_back(_suspects(candidate))
    while (worst := trial.worst(out)) is not None:
        out[worst] = True
    return trial.taken_back(out)


def _suspects(candidate: Candidate) -> Mask:
    error = candidate.held_out.error
    finite = error[np.isfinite(error)]
    usual = float(np.median(finite)) if len(finite) else np.inf
    found: Mask = ~(error <= _SUSPECT_RATIO * usual)
    return found | (candidate.solution.normal.view_weights < _GIVEN_UP)


@dataclass(frozen=True)
class _Trial:
    """The views, and fits of the same model to some of them."""

    candidate: Candidate
    poses: SightPoses
    limits: MotionLimits
    prior: ArmPrior

    @property
    def views(self) -> tuple[CalibrationView, ...]:
        return self.candidate.solution.problem.views

    def taken_back(self, out: Mask) -> Mask:
        """What stays out when all that fit the others are taken back."""
        out = out.copy()
        while out.any():
            fitted = self._fit_to(~out)
            if fitted is None:
                break
            tails = {v: self._tail(fitted, v) for v in np.flatnonzero(out)}
            best = max(tails, key=lambda v: tails[v])
            if tails[best] < _TAIL:
                break
            out[best] = False
        return out

    def worst(self, out: Mask) -> np.intp | None:
        """The view that fits the others least; None where all do, or where they are many."""
        kept, tails = np.flatnonzero(~out), {}
        for v in kept if len(kept) <= _FEW else ():
            rest = ~out
            rest[v] = False
            fitted = self._fit_to(rest)
            if fitted is not None:
                tails[v] = self._tail(fitted, v)
        worst = min(tails, key=lambda v: tails[v], default=None)
        return worst if worst is not None and tails[worst] < _TAIL else None

    def _tail(self, fitted: tuple[Solution, Uncertainty], view: np.intp) -> float:
        return tail_of(*fitted, self.views[view], self.prior)

    def _fit_to(self, kept: Mask) -> tuple[Solution, Uncertainty] | None:
        """The model fitted to some views, their noise included; None where they do not tell it."""
        begin = self.candidate.solution
        rest = begin.problem.with_views([self.views[v] for v in np.flatnonzero(kept)])
        if not self._moves_enough(rest, kept):
            return None
        estimate = replace(begin.estimate, deviations=begin.estimate.deviations[kept])
        try:
            solution = fit(rest, self.candidate.model, estimate, begin.noise, self.prior)
        except Implausible:
            return None
        uncertainty = uncertainty_of(solution)
        return None if np.isnan(uncertainty.std).any() else (solution, uncertainty)

    def _moves_enough(self, rest: Problem, kept: Mask) -> bool:
        place = {v: k for k, v in enumerate(np.flatnonzero(kept).tolist())}
        poses = {(place[v], s): T for (v, s), T in self.poses.items() if v in place}
        found = examine_motion(rest, poses, self.limits)
        wanted = sum(moves(*pair) for pair in pairs_seen(self.candidate.solution.problem))
        return len(found) == wanted and not any(motion.missing for motion in found)


def tail_of(
    solution: Solution, uncertainty: Uncertainty, view: CalibrationView,
    prior: ArmPrior = DEFAULT_PRIOR,
) -> float:  # fmt: skip
    """How often a good view would be as far off as this one, which the solution has not seen.

    Its pixels r count by the pose of each target that they show: with Q an orthonormal basis of
    what a motion of the camera does to them, Q'r is normal with covariance
    N + Q'(J C J' + D S D')Q. C is that of the parameters, S that of an arrival of the arm: at least
    what is assumed of any, for a few views may agree by chance. N is the pixel noise of all rows
    taken together: blur, light and print move a picture's points alike, at worst as a motion
    would. 0 where points would lie behind a camera.
    """
    problem = solution.problem.with_views([view])
    still = replace(solution.estimate, deviations=np.zeros((1, 6)))
    lin = linearise(problem, solution.layout, still)
    if not lin.in_front:
        return 0.0
    parts: list[tuple[Array, ...]] = []
    for number, sight in enumerate(view.sights):
        rows = lin.sights == number
        by_camera = lin.J[rows][:, solution.layout.blocks["eye", sight.eye]]
        Q = np.linalg.qr(by_camera)[0].T
        alike = np.full(len(Q), rows.sum() / len(Q))
        parts.append((Q @ lin.residuals[rows], Q @ lin.J[rows], Q @ lin.J_view[rows], alike))
    z, J, D, alike = (np.concatenate(blocks) for blocks in zip(*parts, strict=True))
    noise = solution.noise
    assumed = np.repeat([prior.deviation_mm / 1e3, np.radians(prior.deviation_deg)], 3)
    exact = solution.layout.model.robot == "exact"
    D = D * (assumed if exact else np.maximum(noise.deviation, assumed))
    own = noise.sigma**2 * np.diag(alike) + D @ D.T
    covariance = J @ uncertainty.covariance @ J.T + uncertainty.inflation**2 * own
    return float(chdtrc(len(z), z @ np.linalg.solve(covariance, z)))
