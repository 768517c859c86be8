"""Blobs put in order: which of them form a given pattern on a lattice.

From a seed and two neighbours the lattice is grown step by step, each step predicted from the
one before, so that perspective and lens may bend it. The two neighbours span the lattice but need
not be the pattern's own axes: all small changes of basis are tried, and those that make the
pattern are its readings.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from aoicell.transforms import Array

_SEEDS = 12
_GAP = 0.3  # how far a blob may lie from where the step before puts it, in steps
Cell = tuple[int, int]
Cells = dict[Cell, int]  # index of the blob on each lattice point

_BASES = [
    np.array(m).reshape(2, 2)
    for m in itertools.product((-1, 0, 1), repeat=4)
    if abs(m[0] * m[3] - m[1] * m[2]) == 1
]


@dataclass(frozen=True)
class Ordered:
    """Readings of the pattern: indices of the blobs, (M,) each; `grown`: size of the lattice."""

    readings: list[NDArray[Any]]
    grown: int


def order(uv_px: Array, pattern: NDArray[Any]) -> Ordered:
    """All ways to lay a pattern (M, 2) of whole numbers, x right and y down, on blobs (N, 2).

    Mirrored ones are left out. The coordinates have to be in a basis that spans the lattice.
    """
    largest = 0
    if len(uv_px) < 4:
        return Ordered([], 0)
    for cells in _grown(uv_px):
        largest = max(largest, len(cells))
        if len(cells) >= len(pattern) and (readings := _readings(cells, pattern, uv_px)):
            return Ordered(readings, len(cells))
    return Ordered([], largest)


def _grown(uv_px: Array) -> Iterator[Cells]:
    """Lattices from several seeds, those in the middle of the crowd first."""
    tree = cKDTree(uv_px)
    near, _ = tree.query(uv_px, k=min(5, len(uv_px)))
    for seed in np.argsort(near[:, 1:].std(axis=1) / near[:, 1:].mean(axis=1))[:_SEEDS]:
        steps = _neighbours(uv_px, tree, int(seed))
        if steps is not None:
            yield _grow(uv_px, tree, int(seed), steps)


def _neighbours(uv_px: Array, tree: Any, seed: int) -> Array | None:
    """The steps (2, 2) to the nearest blob, and to the nearest one in another direction."""
    _, indices = tree.query(uv_px[seed], k=min(9, len(uv_px)))
    steps = uv_px[indices[1:]] - uv_px[seed]
    first = steps[0]
    sines = np.abs(first[0] * steps[:, 1] - first[1] * steps[:, 0])
    aside = sines > 0.5 * np.linalg.norm(first) * np.linalg.norm(steps, axis=1)
    return np.array([first, steps[aside][0]]) if aside.any() else None


def _grow(uv_px: Array, tree: Any, seed: int, steps: Array) -> Cells:
    """Lattice points by breadth first; each keeps the steps that led to it."""
    cells: Cells = {(0, 0): seed}
    local = {(0, 0): steps}
    taken = {seed}
    queue: list[Cell] = [(0, 0)]
    for cell in queue:
        for axis, sign in itertools.product((0, 1), (1, -1)):
            there = (cell[0] + sign * (axis == 0), cell[1] + sign * (axis == 1))
            if there in cells:
                continue
            step = local[cell][axis]
            gap, index = tree.query(uv_px[cells[cell]] + sign * step)
            if gap > _GAP * np.linalg.norm(local[cell], axis=1).min() or index in taken:
                continue
            cells[there] = int(index)
            taken.add(int(index))
            local[there] = local[cell].copy()
            local[there][axis] = sign * (uv_px[index] - uv_px[cells[cell]])
            queue.append(there)
    return cells


def _readings(cells: Cells, pattern: NDArray[Any], uv_px: Array) -> list[NDArray[Any]]:
    """Where the pattern lies on the lattice, in every basis."""
    where, blobs = np.array(list(cells)), np.array(list(cells.values()))
    span = pattern.max(axis=0) - pattern.min(axis=0)
    found = []
    for basis in _BASES:
        turned = where @ basis.T
        low, high = turned.min(axis=0), turned.max(axis=0)
        room = high - low - span
        if (room < 0).any() or (room > 3).any():
            continue
        index = np.full(high - low + 1, -1)
        index[tuple((turned - low).T)] = blobs
        for shift in itertools.product(*(range(r + 1) for r in room)):
            reading = index[tuple((pattern - pattern.min(axis=0) + shift).T)]
            if (reading >= 0).all() and _unmirrored(uv_px[reading], pattern):
                found.append(reading)
    return found


def _unmirrored(uv_px: Array, pattern: NDArray[Any]) -> bool:
    """Whether x turns clockwise into y in the picture (where y is down)."""
    xy = pattern - pattern.mean(axis=0)
    A = np.linalg.lstsq(xy.astype(float), uv_px - uv_px.mean(axis=0), rcond=None)[0]
    return bool(np.linalg.det(A) > 0)
