"""Where the refinement starts: every eye and fixture placed from closed forms, robustly.

A closed form trusts each view alike, so a handful of wrong views ruins it. Small subsets are
solved as well, and the answer that most views agree with is taken.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from aoicell.calibration.bundle import Noise
from aoicell.calibration.closed_forms import ClosedForm, every_closed_form, solve_closed_form
from aoicell.calibration.measurement import POSE_UNIT
from aoicell.calibration.parameters import Estimate
from aoicell.calibration.problem import (
    CalibrationView,
    Eye,
    Fixture,
    PoseSight,
    Problem,
    Sight,
    moves,
    pairs_seen,
    sights_of,
)
from aoicell.errors import Implausible
from aoicell.targets.pose import solve_pose
from aoicell.transforms import SE3, Array, angle_of, apply, mean_pose

# The target in the camera by (view index, sight index).
SightPoses = Mapping[tuple[int, int], SE3]

_SUBSETS, _SUBSET_SIZE = 60, 4


@dataclass(frozen=True)
class PairStart:
    """An eye and a fixture placed from the views that see both; gaps (views,) in m."""

    T_mount_eye: SE3
    T_mount_fixture: SE3
    gaps: Array

    @property
    def typical_gap(self) -> float:
        """Median of the gaps (m)."""
        return float(np.median(self.gaps))


@dataclass(frozen=True)
class Start:
    """A first estimate and how noisy the recording looks from there.

    `gaps_mm` (views,): how far the targets of each view stray from where most views have them.
    """

    estimate: Estimate
    noise: Noise
    gaps_mm: Array


@dataclass(frozen=True)
class Posed:
    """The problem with each sight's own pose of the target in the camera.

    Sights without one are left out of `problem`; `rejected` says why, by view id. `rms_px` is
    the usual reprojection error of a sight by itself (1 where eyes report poses).
    """

    problem: Problem
    poses: SightPoses
    rms_px: float
    rejected: Mapping[str, str]


def sight_poses(problem: Problem) -> Posed:
    """Each sight's T_camera_fixture by itself; drops what has none, with the reason."""
    poses: dict[tuple[int, int], SE3] = {}
    errors: list[float] = []
    views: list[CalibrationView] = []
    rejected: dict[str, str] = {}
    for view in problem.views:
        kept: list[Sight | PoseSight] = []
        for sight in view.sights:
            key = (len(views), len(kept))
            if isinstance(sight, PoseSight):
                poses[key] = sight.T_camera_fixture
            else:
                camera = problem.eye(sight.eye).camera
                assert camera is not None  # the problem has seen to it
                points = problem.fixture(sight.fixture).points[sight.ids]
                name = f"view '{view.id}', '{sight.fixture}' in '{sight.eye}'"
                try:
                    solved = solve_pose(points, sight.uv_px, camera, name=name)
                except Implausible as reason:
                    rejected[view.id] = str(reason)
                    continue
                poses[key] = solved.T_camera_target
                errors.append(solved.rms_px)
            kept.append(sight)
        if kept:
            views.append(replace(view, sights=tuple(kept)))
        else:
            rejected.setdefault(view.id, f"view '{view.id}': nothing is seen in it")
    rms = float(np.median(errors)) if errors else 1.0
    return Posed(problem.with_views(views), poses, rms, rejected)


def start_estimate(problem: Problem, poses: SightPoses, rms: float) -> Start:
    """Places every eye and fixture.

    Raises Implausible when no closed form stands, or when nothing ties an eye to the arm.
    """
    eyes: dict[str, SE3] = {}
    fixtures: dict[str, SE3] = {}
    waiting = pairs_seen(problem)
    # a pair that the arm moves is placed by itself; the pair with the most views goes first
    waiting.sort(key=lambda p: (not moves(*p), -len(list(sights_of(problem, *p)))))
    while waiting:
        known = [p for p in waiting if p[0].name in eyes or p[1].name in fixtures]
        movable = [p for p in waiting if moves(*p)]
        if not known and not movable:
            eye, fixture = waiting[0]
            raise Implausible(
                f"'{eye.name}' and '{fixture.name}' do not move against each other and nothing "
                "ties them to the arm; add views of a target that the arm moves in the picture"
            )
        pair = (known or movable)[0]
        _place(problem, poses, pair, eyes, fixtures)
        waiting.remove(pair)
    estimate = Estimate(
        T_mount_eye=eyes,
        T_mount_fixture=fixtures,
        cameras={e.name: e.camera for e in problem.eyes if e.camera is not None},
        scales={f.name: 1.0 for f in problem.fixtures},
        deviations=np.zeros((len(problem.views), 6)),
    )
    gaps, turns = _strays(problem, poses, estimate)
    sigma = 1.0 if problem.of_poses else float(np.clip(rms, 0.02, 5.0))
    noise = Noise(
        sigma,
        float(np.clip(np.median(gaps), 5e-5, 0.05)),
        float(np.clip(np.median(turns), 2e-5, 0.05)),
    )
    if problem.of_poses:  # one unit of noise per axis, large enough for what is seen
        by_axis = max(np.median(gaps) / POSE_UNIT[0], np.median(turns) / POSE_UNIT[3])
        noise = Noise(float(max(by_axis, 0.05)), noise.deviation_m, noise.deviation_rad)
    return Start(estimate, noise, gaps * 1e3)


def pair_motion(
    problem: Problem, poses: SightPoses, eye: Eye, fixture: Fixture
) -> tuple[list[SE3], list[SE3]]:
    """A and B of A X B = Z for one eye and fixture: X is the eye's mount, Z the fixture's.

    A is the flange for an eye on it, its inverse for a fixture on it, and does not move when
    both stand on the same side.
    """
    As, Bs = [], []
    for v, s in sights_of(problem, eye, fixture):
        T = problem.views[v].T_base_flange
        still = SE3.Identity()
        As.append((T if eye.mount == "flange" else T.inverse()) if moves(eye, fixture) else still)
        Bs.append(poses[v, s])
    return As, Bs


def solve_pair(As: Sequence[SE3], Bs: Sequence[SE3], points: Array) -> PairStart:
    """X and Z of A X B = Z that most views agree with; `points` (N, 3) measure a gap.

    Raises Implausible when no closed form gives an answer that stands.
    """
    solved, failed = every_closed_form(As, Bs)
    candidates = [_pair_start(As, Bs, r.X, r.Z, points) for r in solved]
    candidates += _from_subsets(As, Bs, points)
    if not candidates:
        raise failed[0]
    return _polished(As, Bs, points, min(candidates, key=lambda c: c.typical_gap))


def corners_of(fixture: Fixture) -> Array:
    """Four outer points (4, 3) of a fixture, to measure a gap by."""
    low, high = fixture.points.min(axis=0), fixture.points.max(axis=0)
    x, y = np.array([low[0], high[0]]), np.array([low[1], high[1]])
    return np.array([[x[i], y[j], low[2]] for i in (0, 1) for j in (0, 1)])


def _pair_start(As: Sequence[SE3], Bs: Sequence[SE3], X: SE3, Z: SE3, points: Array) -> PairStart:
    placed = apply(Z, points)
    gaps = [
        np.sqrt(((apply(A * X * B, points) - placed) ** 2).sum(axis=1).mean())
        for A, B in zip(As, Bs, strict=True)
    ]
    return PairStart(X, Z, np.array(gaps))


def _from_subsets(As: Sequence[SE3], Bs: Sequence[SE3], points: Array) -> list[PairStart]:
    """Answers over a few views each, drawn the same way every time."""
    if len(As) <= _SUBSET_SIZE:
        return []
    every = list(combinations(range(len(As)), _SUBSET_SIZE)) if len(As) <= 8 else None
    rng = np.random.default_rng(len(As))
    found = []
    for k in range(_SUBSETS if every is None else min(_SUBSETS, len(every))):
        if every is None:
            chosen = rng.choice(len(As), _SUBSET_SIZE, replace=False).tolist()
        else:
            chosen = list(every[k * len(every) // min(_SUBSETS, len(every))])
        method: ClosedForm = "park" if k % 2 else "shah"
        try:
            result = solve_closed_form([As[i] for i in chosen], [Bs[i] for i in chosen], method)
        except Implausible:
            continue
        found.append(_pair_start(As, Bs, result.X, result.Z, points))
    return found


def _polished(As: Sequence[SE3], Bs: Sequence[SE3], points: Array, best: PairStart) -> PairStart:
    """Solved once more over the views that agree, where some do not."""
    agree = np.flatnonzero(best.gaps <= 4 * best.typical_gap).tolist()
    if len(agree) in (len(As), 0) or len(agree) < 4:
        return best
    solved, _ = every_closed_form([As[i] for i in agree], [Bs[i] for i in agree])
    candidates = [_pair_start(As, Bs, r.X, r.Z, points) for r in solved]
    return min([best, *candidates], key=lambda c: c.typical_gap)


def _place(
    problem: Problem,
    poses: SightPoses,
    pair: tuple[Eye, Fixture],
    eyes: dict[str, SE3],
    fixtures: dict[str, SE3],
) -> None:
    eye, fixture = pair
    As, Bs = pair_motion(problem, poses, eye, fixture)
    points = corners_of(fixture)
    if eye.name not in eyes and fixture.name not in fixtures:
        try:
            start = solve_pair(As, Bs, points)
        except Implausible as reason:
            raise Implausible(f"'{eye.name}' and '{fixture.name}': {reason}") from None
        eyes[eye.name], fixtures[fixture.name] = start.T_mount_eye, start.T_mount_fixture
    elif eye.name not in eyes:  # A X B = Z, so X = A^-1 Z B^-1
        Z = fixtures[fixture.name]
        found = [A.actInv(Z) * B.inverse() for A, B in zip(As, Bs, strict=True)]
        eyes[eye.name] = _agreed(found, lambda T: apply(T, _UNIT_POINTS))
    elif fixture.name not in fixtures:
        X = eyes[eye.name]
        found = [A * X * B for A, B in zip(As, Bs, strict=True)]
        fixtures[fixture.name] = _agreed(found, lambda T: apply(T, points))


_UNIT_POINTS = np.array([[0, 0, 0], [0, 0, 0.5], [0.5, 0, 0.5], [0, 0.5, 0.5]])


def _agreed(Ts: Sequence[SE3], spread: Callable[[SE3], Array]) -> SE3:
    """The mean of the poses that most agree on."""
    places = np.array([spread(T) for T in Ts])
    apart = np.sqrt(((places[:, None] - places[None]) ** 2).sum(axis=3).mean(axis=2))
    centre = int(np.median(apart, axis=1).argmin())
    near = apart[centre] <= 3 * max(float(np.median(apart[centre])), 1e-9)
    return mean_pose([T for T, keep in zip(Ts, near, strict=True) if keep])


def _strays(problem: Problem, poses: SightPoses, estimate: Estimate) -> tuple[Array, Array]:
    """By view: the largest gap of its sights (m) and the largest turn (rad)."""
    gaps, turns = np.zeros(len(problem.views)), np.zeros(len(problem.views))
    for eye, fixture in pairs_seen(problem):
        As, Bs = pair_motion(problem, poses, eye, fixture)
        X, Z = estimate.T_mount_eye[eye.name], estimate.T_mount_fixture[fixture.name]
        gap = _pair_start(As, Bs, X, Z, corners_of(fixture)).gaps
        for (v, _), A, B, g in zip(sights_of(problem, eye, fixture), As, Bs, gap, strict=True):
            gaps[v] = max(gaps[v], g)
            turns[v] = max(turns[v], angle_of((A * X * B).actInv(Z)))
    return gaps, turns
