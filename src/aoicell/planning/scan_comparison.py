"""Targets from a scan against those of the design: what was found, and how far off it is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from aoicell.board import BoardDesign
from aoicell.planning.bumps import Bump
from aoicell.transforms import SE3, Array, rotation, translation

_HARDLY = 0.0005  # outside of an outline (m)
_STEPS = 10  # of the rigid motion that lays found targets over designed ones


@dataclass(frozen=True)
class DesignedTarget:
    """Something of the design that stands out, the uppermost of what stands on each other."""

    id: str
    kind: str
    x: float
    y: float
    width: float
    depth: float
    height: float


@dataclass(frozen=True)
class Match:
    """A designed target and the bump that was found for it; errors are found minus designed (m)."""

    target: DesignedTarget
    bump: Bump
    error: tuple[float, float]
    height_error: float


@dataclass(frozen=True)
class Comparison:
    """`matches` in the frame that lays the found targets best over the designed ones.

    `shift` (m) and `turn` (rad) of the scan's frame in the design's, a half turn included;
    `missed` designed targets; `pieces`: bumps on a designed part for which another bump stands, or
    which is too low to be a target; `extra`: bumps where the design has nothing.
    """

    matches: tuple[Match, ...]
    missed: tuple[DesignedTarget, ...]
    pieces: tuple[Bump, ...]
    extra: tuple[Bump, ...]
    shift: tuple[float, float]
    turn: float

    @property
    def T_scan_board(self) -> SE3:
        """The design's frame in that of the scan."""
        return (translation(*self.shift) * rotation("z", self.turn)).inverse()

    @property
    def position_errors(self) -> Array:
        """How far (N,; m) the matched targets are from where the design has them."""
        return np.array([np.hypot(*match.error) for match in self.matches])

    @property
    def height_errors(self) -> Array:
        """Found minus designed height (N,; m) of the matched targets."""
        return np.array([match.height_error for match in self.matches])


def designed_footprints(board: BoardDesign) -> list[Array]:
    """Corners (4, 2; m), anticlockwise, of all components and marker plates."""
    return [c.footprint for c in board.components] + [m.plate() for m in board.markers]


def designed_targets(board: BoardDesign, least_height: float) -> list[DesignedTarget]:
    """Components and marker plates that are at least that high (m) over what they stand on.

    What carries another of them is left out: from above, the two are one.
    """
    parts = [c for c in board.components if c.height >= least_height]
    carriers = {c.on for c in parts}
    targets = [
        DesignedTarget(c.id, c.kind, c.x, c.y, c.width, c.depth, c.top)
        for c in parts
        if c.id not in carriers
    ]
    plates = [m for m in board.markers if m.z >= least_height]
    return targets + [DesignedTarget(m.id, "marker", m.x, m.y, m.size, m.size, m.z) for m in plates]


def compare(
    bumps: Sequence[Bump],
    targets: Sequence[DesignedTarget],
    footprints: Sequence[Array] = (),
    gate: float = 0.002,
) -> Comparison:
    """Pair bumps and targets that are within `gate` (m) of each other, each once.

    `footprints` (4, 2; m) of all designed parts: what lies in one is no bump of nothing.

    The scan's frame is moved over the design's first: it does not know front from rear, and its
    origin is that of a measured outline. Of both half turns the one with more pairs counts.
    """
    found = np.array([[b.x, b.y] for b in bumps]).reshape(-1, 2)
    designed = np.array([[t.x, t.y] for t in targets]).reshape(-1, 2)
    best = max(
        (_laid_over(found, designed, gate, half_turn) for half_turn in (0.0, np.pi)),
        key=lambda laid: len(laid[2]),
    )
    moved, (shift, turn), pairs = best
    matches = tuple(
        Match(
            targets[t], bumps[b],
            (float(moved[b, 0] - targets[t].x), float(moved[b, 1] - targets[t].y)),
            bumps[b].height - targets[t].height,
        )
        for b, t in pairs
    )  # fmt: skip
    used_bumps, used_targets = {b for b, _ in pairs}, {t for _, t in pairs}
    left = [b for b in range(len(bumps)) if b not in used_bumps]
    designed_there = {b for b in left if any(_inside(moved[b], f) for f in footprints)}
    return Comparison(
        matches,
        tuple(t for i, t in enumerate(targets) if i not in used_targets),
        tuple(bumps[b] for b in left if b in designed_there),
        tuple(bumps[b] for b in left if b not in designed_there),
        (float(shift[0]), float(shift[1])), turn,
    )  # fmt: skip


def _inside(place: Array, corners: Array) -> bool:
    """Whether a place (2,) lies in a convex outline (4, 2), anticlockwise, or hardly outside."""
    sides, ways = np.roll(corners, -1, axis=0) - corners, place - corners
    across = sides[:, 0] * ways[:, 1] - sides[:, 1] * ways[:, 0]
    return bool((across >= -_HARDLY * np.linalg.norm(sides, axis=1)).all())


_Laid = tuple[Array, tuple[Array, float], list[tuple[int, int]]]


def _laid_over(found: Array, designed: Array, gate: float, turn: float) -> _Laid:
    """Found places (N, 2) moved over the designed ones, the motion, and the pairs."""
    shift, pairs = np.zeros(2), list[tuple[int, int]]()
    for step in range(_STEPS):
        moved = found @ _rotation(turn).T + shift
        width = gate * max(1.0, 3.0 - step)  # wider while the frames are not yet together
        pairs = _pairs(moved, designed, width)
        if len(pairs) < 3:
            break
        shift, turn = _motion(found[[b for b, _ in pairs]], designed[[t for _, t in pairs]])
    moved = found @ _rotation(turn).T + shift
    return moved, (shift, turn), _pairs(moved, designed, gate)


def _pairs(found: Array, designed: Array, gate: float) -> list[tuple[int, int]]:
    """Pairs of indices with the least sum of distances, each within the gate (m)."""
    if not len(found) or not len(designed):
        return []
    distances = np.linalg.norm(found[:, None] - designed, axis=2)
    rows, columns = linear_sum_assignment(np.minimum(distances, gate))
    near = distances[rows, columns] < gate
    return list(zip(rows[near].tolist(), columns[near].tolist(), strict=True))


def _motion(found: Array, designed: Array) -> tuple[Array, float]:
    """Shift and turn of the plane that lay (N, 2) over (N, 2) with the least squares."""
    a, b = found - found.mean(axis=0), designed - designed.mean(axis=0)
    turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    return designed.mean(axis=0) - _rotation(turn) @ found.mean(axis=0), turn


def _rotation(turn: float) -> Array:
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s], [s, c]])


def distances_px(found: Sequence[Array], expected: Array, gate_px: float = 20.0) -> Array:
    """Distances (M,) of expected points (N, 2) to the nearest found ones, where one is near."""
    if not found or not len(expected):
        return np.empty(0)
    points = np.concatenate(found)
    nearest = np.linalg.norm(expected[:, None] - points, axis=2).min(axis=1)
    return np.asarray(nearest[nearest < gate_px])
