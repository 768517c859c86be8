"""Which way round an even board was read in each view, settled by the arm's own motion.

A board that looks the same after a half turn is read one way in one picture and the other way
in the next. The angle between two camera poses does not depend on the hand-eye: it is the
arm's. So each pair of views votes on whether both were read alike, the votes are reconciled
(the leading eigenvector of the vote matrix; Singer 2011, "Angular synchronization"), and a
hand-eye through the outcome has the last word on each view. Which of the two ends of the print
is up stays open: the first view's reading names it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.calibration.problem import (
    CalibrationView,
    Eye,
    Fixture,
    Mask,
    PoseSight,
    Problem,
    Sight,
    pairs_seen,
    sights_of,
)
from aoicell.calibration.starts import SightPoses, corners_of, pair_motion, solve_pair
from aoicell.errors import Implausible
from aoicell.transforms import SE3, Array, angle_of, apply, rotation, translation

_VOTE_RAD = 0.1  # a difference of this much is a clear vote


@dataclass(frozen=True)
class Readings:
    """The problem with each sight read the way the arm's motion wants it.

    `poses` goes with it. `turned`: ids of views in which a sight was turned; `unsettled`: ids
    of views in which both readings fit about equally well.
    """

    problem: Problem
    poses: SightPoses
    turned: tuple[str, ...]
    unsettled: tuple[str, ...]


def settle_half_turns(problem: Problem, poses: SightPoses) -> Readings:
    """Chooses a reading for each sight of a fixture that has two."""
    settled = dict(poses)
    turned: set[tuple[int, int]] = set()
    unsettled: set[int] = set()
    for eye, fixture in pairs_seen(problem):
        if not fixture.half_turns:
            continue
        where = list(sights_of(problem, eye, fixture))
        As, Bs = pair_motion(problem, settled, eye, fixture)
        flips, unsure = _settle_pair(As, Bs, fixture)
        F = half_turn_of(fixture)
        for key, flip, doubt in zip(where, flips, unsure, strict=True):
            if flip:
                settled[key] = settled[key] * F
                turned.add(key)
            if doubt:
                unsettled.add(key[0])
    for eye, fixture in _turned_as_a_whole(problem, settled):
        F = half_turn_of(fixture)
        for key in sights_of(problem, eye, fixture):
            settled[key] = settled[key] * F
            turned ^= {key}
    ids = [view.id for view in problem.views]
    return Readings(
        problem.with_views([_read(problem, v, view, turned) for v, view in _views(problem)]),
        settled,
        tuple(ids[v] for v in sorted({v for v, _ in turned})),
        tuple(ids[v] for v in sorted(unsettled)),
    )


def half_turn_of(fixture: Fixture) -> SE3:
    """The half turn (about z through the middle of the points) that maps the print to itself."""
    x, y, _ = fixture.points.mean(axis=0)
    return translation(x, y) * rotation("z", np.pi) * translation(-x, -y)


def _views(problem: Problem) -> list[tuple[int, CalibrationView]]:
    return list(enumerate(problem.views))


def _read(
    problem: Problem, v: int, view: CalibrationView, turned: set[tuple[int, int]]
) -> CalibrationView:
    sights: list[Sight | PoseSight] = []
    for s, sight in enumerate(view.sights):
        if (v, s) in turned and isinstance(sight, Sight):
            last = len(problem.fixture(sight.fixture).points) - 1
            sight = replace(sight, ids=last - np.asarray(sight.ids))
        elif (v, s) in turned and isinstance(sight, PoseSight):
            F = half_turn_of(problem.fixture(sight.fixture))
            sight = replace(sight, T_camera_fixture=sight.T_camera_fixture * F)
        sights.append(sight)
    return replace(view, sights=tuple(sights))


def _settle_pair(As: Sequence[SE3], Bs: Sequence[SE3], fixture: Fixture) -> tuple[Mask, Mask]:
    F = half_turn_of(fixture)
    flips = _by_votes(As, Bs, F)
    points = corners_of(fixture)
    unsure = np.zeros(len(As), dtype=bool)
    for _ in range(5):
        read = [B * F if flip else B for B, flip in zip(Bs, flips, strict=True)]
        try:
            start = solve_pair(As, read, points)
        except Implausible:
            break  # the motion is judged elsewhere; the votes stand
        X, placed = start.T_mount_eye, apply(start.T_mount_fixture, points)
        gaps = np.array(
            [
                [np.linalg.norm(apply(A * X * T, points) - placed) for T in (B, B * F)]
                for A, B in zip(As, Bs, strict=True)
            ]
        )
        better = gaps[:, 1] < gaps[:, 0]
        unsure = gaps.min(axis=1) > 0.5 * gaps.max(axis=1)
        if (better == flips).all():
            break
        flips = better
    return (~flips if flips[0] else flips), unsure


def _by_votes(As: Sequence[SE3], Bs: Sequence[SE3], F: SE3) -> Mask:
    votes = np.zeros((len(As), len(As)))
    for i in range(len(As)):
        for j in range(i):
            arm = angle_of(As[i].actInv(As[j]))
            alike = abs(angle_of(Bs[i] * Bs[j].inverse()) - arm)
            turned = abs(angle_of(Bs[i] * F * Bs[j].inverse()) - arm)
            votes[i, j] = votes[j, i] = np.tanh((turned - alike) / _VOTE_RAD)
    leading = np.linalg.eigh(votes)[1][:, -1]
    flips: Mask = leading * leading[0] < 0
    return flips


def _turned_as_a_whole(problem: Problem, poses: SightPoses) -> list[tuple[Eye, Fixture]]:
    """Pairs whose views agree among themselves but not with another eye's view of the fixture."""
    eyes: dict[str, SE3] = {}
    fixtures: dict[str, SE3] = {}
    turned = []
    # a fixture that cannot be mistaken, and one seen in motion, go first
    pairs = sorted(pairs_seen(problem), key=lambda p: (p[0].mount == p[1].mount, p[1].half_turns))
    for eye, fixture in pairs:
        As, Bs = pair_motion(problem, poses, eye, fixture)
        points = corners_of(fixture)
        if eye.name in eyes and fixture.name in fixtures:
            X, Z = eyes[eye.name], fixtures[fixture.name]
            if fixture.half_turns and _gap(As, Bs, X, Z * half_turn_of(fixture), points) < _gap(
                As, Bs, X, Z, points
            ):
                turned.append((eye, fixture))
            continue
        if eye.mount == fixture.mount:
            if eye.name in eyes:
                fixtures[fixture.name] = eyes[eye.name] * Bs[0]
            elif fixture.name in fixtures:
                eyes[eye.name] = fixtures[fixture.name] * Bs[0].inverse()
            continue
        try:
            start = solve_pair(As, Bs, points)
        except Implausible:
            continue
        X, Z = start.T_mount_eye, start.T_mount_fixture
        if fixture.name in fixtures and fixture.half_turns:
            F = half_turn_of(fixture)
            known = apply(fixtures[fixture.name], points)
            if np.linalg.norm(apply(Z * F, points) - known) < np.linalg.norm(
                apply(Z, points) - known
            ):
                turned.append((eye, fixture))
        eyes.setdefault(eye.name, X)
        fixtures.setdefault(fixture.name, Z)
    return turned


def _gap(As: Sequence[SE3], Bs: Sequence[SE3], X: SE3, Z: SE3, points: Array) -> float:
    placed = apply(Z, points)
    return float(
        np.median(
            [np.linalg.norm(apply(A * X * B, points) - placed) for A, B in zip(As, Bs, strict=True)]
        )
    )
