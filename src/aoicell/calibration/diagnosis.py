"""What may be wrong with a recording, found after a first fit.

Pictures that belong to another pose, prints of another size than declared, intrinsics that the
recording contradicts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.calibration.bundle import Solution
from aoicell.calibration.closed_forms import scale_from_motion
from aoicell.calibration.parameters import DEFAULT_PRIOR, LENSES, ArmPrior, Estimate, Model
from aoicell.calibration.problem import (
    CalibrationView,
    Problem,
    Sight,
    moves,
    pairs_seen,
    sights_of,
)
from aoicell.calibration.selection import Candidate, better, fit, hold_out, predicted_residuals
from aoicell.calibration.starts import SightPoses, Start, pair_motion
from aoicell.calibration.uncertainty import uncertainty_of
from aoicell.camera import Camera
from aoicell.errors import Implausible
from aoicell.transforms import SE3, Array

# A picture belongs to another pose when it fits there at least so many times better.
_SHUFFLE_RATIO = 5.0


@dataclass(frozen=True)
class Size:
    """How much larger a print is than declared, as the arm's own motion measures it."""

    fixture: str
    factor: float
    std: float

    @property
    def wrong(self) -> bool:
        """Off by more than four standard deviations and by more than 0.1 %."""
        return bool(abs(self.factor - 1) > max(4 * self.std, 1e-3))


def shuffled(
    solution: Solution, suspects: Sequence[CalibrationView], views: Sequence[CalibrationView]
) -> Mapping[str, str]:
    """Suspect view id -> id of the view whose arm pose its picture fits much better."""
    found = {}
    for seen in suspects:
        errors = np.array([_misfit(solution, seen, at) for at in views])
        own = next(k for k, at in enumerate(views) if at.id == seen.id)
        best = int(np.argmin(errors))
        if best != own and errors[best] * _SHUFFLE_RATIO < errors[own]:
            found[seen.id] = views[best].id
    return found


def _misfit(solution: Solution, seen: CalibrationView, at: CalibrationView) -> float:
    """Median residual of a view's picture at an arm pose."""
    return float(np.median(np.abs(predicted_residuals(solution, solution.estimate, seen, at))))


def size_hints(problem: Problem, poses: SightPoses, start: Start) -> Mapping[str, Size]:
    """Size of each fixture that the arm moves in a picture, before any refinement, roughly."""
    hints: dict[str, Size] = {}
    for eye, fixture in pairs_seen(problem):
        if not moves(eye, fixture):
            continue
        As, Bs = pair_motion(problem, poses, eye, fixture)
        gaps = np.array([start.gaps_mm[v] for v, _ in sights_of(problem, eye, fixture)])
        agree = np.flatnonzero(gaps <= 4 * max(float(np.median(gaps)), 1e-6))
        factor, std, _ = scale_from_motion(
            [As[i] for i in agree], [Bs[i] for i in agree], start.estimate.T_mount_eye[eye.name]
        )
        if fixture.name not in hints or std < hints[fixture.name].std:
            hints[fixture.name] = Size(fixture.name, factor, std)
    return hints


def resized(problem: Problem, poses: SightPoses, hints: Mapping[str, Size]) -> SightPoses:
    """The targets' poses in the camera if the prints have the sizes of the hints."""
    changed = dict(poses)
    for v, view in enumerate(problem.views):
        for s, sight in enumerate(view.sights):
            factor = hints[sight.fixture].factor if sight.fixture in hints else 1.0
            T = poses[v, s]
            changed[v, s] = SE3(T.rotation, factor * T.translation)
    return changed


def try_sizes(
    best: Candidate, begin: Estimate | None = None, prior: ArmPrior = DEFAULT_PRIOR
) -> tuple[Candidate, tuple[Size, ...]] | None:
    """The same model with the size of each fixture that the arm moves free, and those sizes.

    `begin` starts it elsewhere than at the best candidate. None where nothing came of it.
    """
    problem = best.solution.problem
    names = {f.name for e, f in pairs_seen(problem) if moves(e, f)}
    free = tuple(f.name for f in problem.fixtures if f.name in names)
    model = replace(best.model, free_scales=free)
    try:
        start = begin or best.solution.estimate
        solution = fit(problem, model, start, best.solution.noise, prior)
    except Implausible:
        return None
    uncertainty = uncertainty_of(solution)
    sizes = []
    for name in free:
        index = solution.layout.blocks["scale", name].start
        std = float(uncertainty.std[index])
        if np.isfinite(std):
            sizes.append(Size(name, solution.estimate.scales[name], std))
    return Candidate(model, solution, hold_out(solution)), tuple(sizes)


def try_intrinsics(best: Candidate, prior: ArmPrior = DEFAULT_PRIOR) -> Candidate | None:
    """A fit with all intrinsics refined that predicts better than with those supplied.

    None where it does not, or where all are refined anyway.
    """
    problem = best.solution.problem
    if all(e.refine or e.camera is None for e in problem.eyes):
        return None
    eyes = tuple(replace(e, refine=True) for e in problem.eyes)
    freed = replace(problem, eyes=eyes)
    found: Candidate | None = None
    for lens in LENSES:
        model = Model(lens, best.model.robot, best.model.free_scales)
        try:
            solution = fit(freed, model, best.solution.estimate, best.solution.noise, prior)
        except Implausible:
            continue
        candidate = Candidate(model, solution, hold_out(solution))
        every = np.ones(len(problem.views), dtype=bool)
        if better(candidate.held_out, (found or best).held_out, every):
            found = candidate
    return found


def lens_gap_px(start: Camera, estimated: Camera, uv_px: Array) -> float:
    """Largest difference (px) between two cameras at pixels (N, 2), a small turn left aside.

    A turn of the camera looks like a shift of the principal point and is the mount's business.
    """
    rays = np.column_stack([estimated.unproject(uv_px), np.ones(len(uv_px))])
    gap = start.project(rays) - uv_px
    x, y = rays[:, 0], rays[:, 1]
    f = start.focal_px
    turns = np.stack(
        [
            np.column_stack([f * x * y, -f * (1 + x * x), f * y]),
            np.column_stack([f * (1 + y * y), -f * x * y, -f * x]),
        ],
        axis=1,
    ).reshape(-1, 3)
    left = gap.ravel() - turns @ np.linalg.lstsq(turns, gap.ravel(), rcond=None)[0]
    return float(np.linalg.norm(left.reshape(-1, 2), axis=1).max())


def pixels_of(problem: Problem, eye: str) -> Array:
    """All pixels (N, 2) that an eye saw a target's point at."""
    seen = [
        s.uv_px for v in problem.views for s in v.sights if isinstance(s, Sight) and s.eye == eye
    ]
    return np.vstack(seen) if seen else np.zeros((0, 2))
