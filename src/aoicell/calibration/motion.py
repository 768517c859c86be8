"""Is the motion enough, judged before anything is solved, and which motion is missing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aoicell.calibration.problem import Eye, Fixture, Problem, moves, pairs_seen, sights_of
from aoicell.calibration.starts import SightPoses
from aoicell.transforms import SE3, Array, mean_pose, to_rvec


@dataclass(frozen=True)
class MotionLimits:
    """What is demanded of the views of one eye and one fixture that move against each other.

    Spreads are root mean squares over the views about their mean. Below `poor` a motion is
    enough to solve, but not to trust.
    """

    min_views: int = 4
    poor_views: int = 6
    min_turn_deg: float = 1.0
    poor_turn_deg: float = 4.0
    poor_tilt_deg: float = 6.0
    poor_depth_ratio: float = 1.05


DEFAULT_MOTION = MotionLimits()


@dataclass(frozen=True)
class Motion:
    """The motion in the views of one eye and one fixture.

    `turn_deg` (3,): spread of the flange's rotations about their principal axes, the largest
    first; `axes` (3, 3): those axes as rows, in the mean flange. `range_deg`: largest rotation
    from the mean. `tilt_deg`: spread of the target's tilt to the line of sight, both ways.
    `depth_ratio`: farthest over nearest. `missing` refuses, `poor` warns; each a sentence.
    """

    eye: str
    fixture: str
    views: int
    turn_deg: Array
    axes: Array
    range_deg: float
    tilt_deg: float
    depth_ratio: float
    missing: tuple[str, ...]
    poor: tuple[str, ...]


def examine_motion(
    problem: Problem, poses: SightPoses, limits: MotionLimits = DEFAULT_MOTION
) -> tuple[Motion, ...]:
    """One finding for each eye and fixture that the arm moves against each other."""
    return tuple(
        _examine(problem, poses, eye, fixture, limits)
        for eye, fixture in pairs_seen(problem)
        if moves(eye, fixture)
    )


def unseen(problem: Problem) -> list[str]:
    """Eyes and fixtures that no view is about, and eyes before which nothing moves, as sentences.

    `problem` may hold eyes that see nothing; a fixture that stands still tells no lens.
    """
    seen = pairs_seen(problem)
    eyes, fixtures = {e.name for e, _ in seen}, {f.name for _, f in seen}
    found = [
        f"'{eye.name}' sees no target in any view; check its pictures and the targets' kinds, or "
        "leave it out"
        for eye in problem.eyes
        if eye.name not in eyes
    ]
    found += [
        f"no view shows '{fixture.name}'; check its kind and counts, or leave it out"
        for fixture in problem.fixtures
        if fixture.name not in fixtures
    ]
    moving = {e.name for e, f in seen if moves(e, f)}
    return found + [
        f"all that '{eye.name}' sees stands still before it, so that its intrinsics cannot be "
        "told; give calibrated ones and refine = false, or show it a target that the arm moves"
        for eye in problem.eyes
        if eye.name in eyes - moving and eye.camera is not None and eye.refine
    ]


def _examine(
    problem: Problem, poses: SightPoses, eye: Eye, fixture: Fixture, limits: MotionLimits
) -> Motion:
    where = list(sights_of(problem, eye, fixture))
    turns = _turns([problem.views[v].T_base_flange for v, _ in where])
    _, sizes, axes = np.linalg.svd(turns, full_matrices=True)
    turn = np.zeros(3)
    turn[: len(sizes)] = np.degrees(sizes[:3]) / np.sqrt(len(turns))
    centre = fixture.points.mean(axis=0)
    places = np.array([poses[key].act(centre) for key in where])
    tilts = _tilts([poses[key] for key in where], places)
    depths = places[:, 2]
    depth_ratio = float(depths.max() / depths.min()) if depths.min() > 0 else np.inf
    name = f"'{fixture.name}' in '{eye.name}'"
    views = len(where)
    refining = eye.camera is not None and eye.refine
    return Motion(
        eye.name, fixture.name, views, turn, axes,
        float(np.degrees(np.linalg.norm(turns, axis=1)).max()), tilts, depth_ratio,
        tuple(_missing(name, views, turn, axes, limits)),
        tuple(_poor(name, views, turn, axes, tilts, depth_ratio, refining, limits)),
    )  # fmt: skip


def _turns(Ts: Sequence[SE3]) -> Array:
    """Rotation vectors (views, 3) from the mean rotation."""
    mean = mean_pose(Ts)
    return np.array([to_rvec(mean.actInv(T))[0] for T in Ts])


def _tilts(Ts: Sequence[SE3], places: Array) -> float:
    """Spread (deg) of the target's normal against the line of sight: 0 if all are frontal."""
    sights = -places / np.linalg.norm(places, axis=1, keepdims=True)
    normals = np.array([T.rotation[:, 2] for T in Ts])
    leans = np.degrees(np.arccos(np.clip((normals * sights).sum(axis=1), -1, 1)))
    return float(np.sqrt((leans**2).mean()))


def _missing(
    name: str, views: int, turn: Array, axes: Array, limits: MotionLimits
) -> list[str]:  # at most one: the first thing to mend
    if views < limits.min_views:
        return [
            f"{name}: {views} views are too few to solve and check a hand-eye; take at least "
            f"{limits.min_views}, better 15"
        ]
    if turn[0] < limits.min_turn_deg:
        return [
            f"{name}: the flange only translates (its rotation spreads by {turn[0]:.2f} deg); "
            "where the camera sits on it cannot be told: turn it about two axes by 15 deg or more"
        ]
    if turn[1] < limits.min_turn_deg:
        return [
            f"{name}: the flange turns about one axis only, {_axis(axes[0])} of the flange (across "
            f"it by {turn[1]:.2f} deg); tilt it about another axis by 15 deg or more"
        ]
    return []


def _poor(
    name: str, views: int, turn: Array, axes: Array, tilt: float, depth_ratio: float,
    refining: bool, limits: MotionLimits,
) -> list[str]:  # fmt: skip
    found = []
    if views < limits.poor_views:
        found.append(f"{name}: {views} views leave little to check the result by; take 15")
    if limits.min_turn_deg <= turn[1] < limits.poor_turn_deg:
        found.append(
            f"{name}: the flange turns by {turn[1]:.1f} deg (rms) about its second axis, "
            f"{_axis(axes[1])}; tilt it more about that one"
        )
    if refining and tilt < limits.poor_tilt_deg:
        close = depth_ratio < limits.poor_depth_ratio
        found.append(
            f"{name}: all views are frontal (tilt {tilt:.1f} deg rms)"
            + (" and from one distance" if close else "")
            + "; the focal length is hardly observable: tilt the target both ways by 20 deg"
        )
    return found


def _axis(axis: Array) -> str:
    axis = axis * np.sign(axis[np.abs(axis).argmax()])
    return "(" + ", ".join(f"{v:.2f}" for v in axis + 0.0) + ")"
