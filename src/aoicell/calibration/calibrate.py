"""From a recording to a judged calibration: the steps in their order.

Each target posed by itself, even boards read the right way round, the motion examined, a start
from closed forms, the model chosen on held-out views, what does not fit named and left out,
sizes and intrinsics doubted, and a verdict.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from aoicell.calibration.diagnosis import (
    Size,
    lens_gap_px,
    pixels_of,
    resized,
    shuffled,
    size_hints,
    try_intrinsics,
    try_sizes,
)
from aoicell.calibration.half_turns import settle_half_turns
from aoicell.calibration.motion import (
    DEFAULT_MOTION,
    Motion,
    MotionLimits,
    examine_motion,
    unseen,
)
from aoicell.calibration.outliers import outliers
from aoicell.calibration.parameters import (
    DEFAULT_PRIOR,
    LENSES,
    ArmPrior,
    Estimate,
    Lens,
    RobotModel,
)
from aoicell.calibration.problem import CalibrationView, Problem, moves, pairs_seen, sights_of
from aoicell.calibration.selection import Candidate, HeldOut, better, hold_out, select
from aoicell.calibration.starts import Posed, Start, sight_poses, start_estimate
from aoicell.calibration.uncertainty import uncertainty_of
from aoicell.calibration.verdict import (
    DEFAULT_LIMITS,
    CalibrationReport,
    Limits,
    ModelScore,
    Verdict,
    ViewFinding,
    judge_fit,
    judge_sizes,
    rms,
    score,
)
from aoicell.errors import Implausible


@dataclass(frozen=True)
class CalibrationConfig:
    """Models to choose from, what is assumed of the arm, and when to doubt and to refuse."""

    lenses: tuple[Lens, ...] = tuple(LENSES)
    robots: tuple[RobotModel, ...] = ("joint_terms", "per_view", "exact")
    prior: ArmPrior = DEFAULT_PRIOR
    motion: MotionLimits = DEFAULT_MOTION
    limits: Limits = DEFAULT_LIMITS


@dataclass
class _Findings:
    """What gathers on the way to a report."""

    ids: list[str]
    motion: tuple[Motion, ...] = ()
    refuse: list[str] = field(default_factory=list)
    suspect: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    unused: dict[str, str] = field(default_factory=dict)
    sizes: tuple[Size, ...] = ()
    tried: list[ModelScore] = field(default_factory=list)

    def report(self, best: Candidate | None = None) -> CalibrationReport:
        """The report, without a solution where there is none."""
        verdict: Verdict = "refused" if self.refuse else "suspect" if self.suspect else "ok"
        reasons, warnings = (*self.refuse, *self.suspect), tuple(self.warnings)
        if best is None:
            views = [ViewFinding(i, i not in self.unused, self.unused.get(i, "")) for i in self.ids]
            return CalibrationReport(
                verdict, reasons, warnings, tuple(views), self.motion, self.sizes, tuple(self.tried)
            )
        held_out = best.held_out
        return CalibrationReport(
            verdict, reasons, warnings, tuple(self._views(best)), self.motion, self.sizes,
            tuple(self.tried), best.solution, uncertainty_of(best.solution),
            rms(held_out.px), rms(held_out.mm),
        )  # fmt: skip

    def _views(self, best: Candidate) -> list[ViewFinding]:
        at = {view.id: k for k, view in enumerate(best.solution.problem.views)}
        found = []
        for name in self.ids:
            if name not in at:
                found.append(ViewFinding(name, False, self.unused.get(name, "")))
                continue
            k = at[name]
            left = best.solution.lin.residuals[best.solution.lin.rows[k]]
            px = np.nan if best.solution.problem.of_poses else np.sqrt(2 * (left**2).mean())
            held = best.held_out
            found.append(
                ViewFinding(name, True, "", float(px), float(held.px[k]), float(held.mm[k]))
            )
        return found


def calibrate(
    problem: Problem, config: CalibrationConfig = CalibrationConfig()
) -> CalibrationReport:
    """Solves and judges a recording; a hopeless one comes back as 'refused', with reasons."""
    findings = _Findings([view.id for view in problem.views])
    posed = sight_poses(problem)
    findings.unused.update(posed.rejected)
    if not posed.poses:
        findings.refuse.append("no view shows a target; check the pictures and the target's kind")
        return findings.report()
    if any(f.half_turns for f in problem.fixtures):
        readings = settle_half_turns(posed.problem, posed.poses)
        posed = replace(posed, problem=readings.problem, poses=readings.poses)
        if readings.unsettled:
            findings.warnings.append(
                f"views {', '.join(readings.unsettled)}: which way round the board is cannot be "
                "told from the arm's motion"
            )
    findings.refuse += unseen(posed.problem)
    findings.motion = examine_motion(posed.problem, posed.poses, config.motion)
    findings.refuse += [s for m in findings.motion for s in m.missing]
    findings.suspect += [s for m in findings.motion for s in m.poor]
    if findings.refuse:
        return findings.report()
    try:
        start, hints = _begin(posed, findings, config)
        if findings.refuse:
            return findings.report()
        best = _choose(posed, start, hints, findings, config)
    except Implausible as reason:
        findings.refuse.append(str(reason))
        return findings.report()
    return _judge(best, findings, config)


def _begin(
    posed: Posed, findings: _Findings, config: CalibrationConfig
) -> tuple[Start, Mapping[str, Size]]:
    """The start, and hopeless sizes refused before anything is built on them."""
    start = start_estimate(posed.problem, posed.poses, posed.rms_px)
    hints = size_hints(posed.problem, posed.poses, start)
    for hint in hints.values():
        sure = hint.std < 0.2 * abs(hint.factor)
        if sure and not 0.5 < hint.factor < 2:
            findings.refuse.append(
                f"'{hint.fixture}': the arm's motion makes it about {hint.factor:.3g} times as "
                "large as declared; check the length unit of the poses (mm or m) and its size"
            )
    return start, hints


def _choose(
    posed: Posed, start: Start, hints: Mapping[str, Size], findings: _Findings,
    config: CalibrationConfig,
) -> Candidate:  # fmt: skip
    """The best model over the views that fit, sizes and intrinsics doubted."""
    problem = posed.problem
    best = _select(problem, start.estimate, start, findings, config)
    bad = outliers(best, posed.poses, config.motion, config.prior)
    if bad.any():
        kept = [v for v, out in zip(problem.views, bad, strict=True) if not out]
        suspects = [v for v, out in zip(problem.views, bad, strict=True) if out]
        if bad.mean() > config.limits.refuse_outliers or len(kept) < config.motion.min_views:
            raise Implausible(
                f"{len(suspects)} of {len(problem.views)} views fit no common hand-eye; check that "
                "pictures and poses belong together, and the convention and unit of the poses"
            )
        _check_left(problem, problem.with_views(kept), config.motion)
        estimate = best.solution.estimate
        left = replace(estimate, deviations=estimate.deviations[~bad])
        best = _select(problem.with_views(kept), left, start, findings, config)
        _name_outliers(best, suspects, problem.views, findings)
    best = _doubt_sizes(best, posed, start, hints, findings, config)
    return _doubt_intrinsics(best, findings, config)


def _check_left(problem: Problem, kept: Problem, limits: MotionLimits) -> None:
    """Without its outliers a recording has to show each target in motion often enough still."""
    for eye, fixture in pairs_seen(problem):
        left = len(list(sights_of(kept, eye, fixture)))
        if moves(eye, fixture) and left < limits.min_views:
            raise Implausible(
                f"'{fixture.name}' in '{eye.name}': without the views that do not fit the others "
                f"{left} are left, at least {limits.min_views} are needed; take more views of it"
            )


def _select(
    problem: Problem, estimate: Estimate, start: Start, findings: _Findings,
    config: CalibrationConfig,
) -> Candidate:  # fmt: skip
    best, tried = select(problem, estimate, start.noise, config.lenses, config.robots, config.prior)
    findings.tried = [score(candidate) for candidate in tried]
    return best


def _name_outliers(
    best: Candidate, suspects: list[CalibrationView], views: tuple[CalibrationView, ...],
    findings: _Findings,
) -> None:  # fmt: skip
    belongs = shuffled(best.solution, suspects, views)
    for view in suspects:
        reason = "does not fit the other views"
        if view.id in belongs:
            reason = f"its picture fits the arm pose of view '{belongs[view.id]}', not its own"
        findings.unused[view.id] = reason
        findings.suspect.append(f"view '{view.id}': {reason}")


def _doubt_sizes(
    best: Candidate, posed: Posed, start: Start, hints: Mapping[str, Size],
    findings: _Findings, config: CalibrationConfig,
) -> Candidate:  # fmt: skip
    """Measures the prints by the arm's motion; believes it where that predicts better."""
    begin = None
    if any(abs(h.factor - 1) > max(0.02, 5 * h.std) for h in hints.values()):
        begin = _resized_start(best, posed, hints)
    tried = try_sizes(best, begin, config.prior)
    if tried is None:
        return best
    candidate, findings.sizes = tried
    every = np.ones(len(candidate.held_out.mm), dtype=bool)
    wrong = any(size.wrong for size in findings.sizes)
    return candidate if wrong and better(candidate.held_out, best.held_out, every) else best


def _resized_start(best: Candidate, posed: Posed, hints: Mapping[str, Size]) -> Estimate | None:
    problem = best.solution.problem
    again = sight_poses(problem)
    try:
        start = start_estimate(problem, resized(problem, again.poses, hints), posed.rms_px)
    except Implausible:
        return None
    known = {name: h.factor for name, h in hints.items()}
    return replace(
        start.estimate,
        cameras=best.solution.estimate.cameras,
        scales={**start.estimate.scales, **known},
    )


def _doubt_intrinsics(best: Candidate, findings: _Findings, config: CalibrationConfig) -> Candidate:
    """Compares supplied intrinsics with what the recording says."""
    freed = try_intrinsics(best, config.prior)
    if freed is not None:
        before, after = rms(best.held_out.px), rms(freed.held_out.px)
        findings.suspect.append(
            f"the supplied intrinsics are contradicted: with estimated ones ({freed.model.lens}) "
            f"the held-out error falls from {before:.2f} to {after:.2f} px; let them be refined"
        )
    for eye in best.solution.problem.eyes:
        if eye.camera is None or not eye.refine:
            continue
        gap = lens_gap_px(
            eye.camera, best.solution.estimate.cameras[eye.name],
            pixels_of(best.solution.problem, eye.name),
        )  # fmt: skip
        if gap > 2:
            findings.warnings.append(
                f"'{eye.name}': the intrinsics to start from are up to {gap:.1f} px off where "
                "targets were seen; the refined ones are used"
            )
    return best


def _judge(best: Candidate, findings: _Findings, config: CalibrationConfig) -> CalibrationReport:
    """The final held-out errors by true refits, and the verdict."""
    solution = best.solution
    held_out: HeldOut = hold_out(solution, refit=True)
    best = replace(best, held_out=held_out)
    uncertainty = uncertainty_of(solution)
    refuse, suspect = judge_fit(solution, held_out, uncertainty, config.limits)
    declared = [s for s in findings.sizes if solution.problem.fixture(s.fixture).scale == "known"]
    if not refuse:  # a fit that does not hold measures no sizes either
        refuse, doubts = judge_sizes(declared, config.limits)
        suspect += doubts
    findings.refuse += refuse
    findings.suspect += suspect
    untold = [f.sentence for f in uncertainty.unobservable]
    if findings.refuse and len(untold) > 1:  # nobody will use those numbers
        untold = [f"{untold[0]}, and {len(untold) - 1} more that nothing tells"]
    findings.warnings += untold
    return findings.report(best)
