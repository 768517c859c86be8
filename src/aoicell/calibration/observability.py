"""What a recording cannot tell, by name.

A freedom is a direction in which all parameters can move together without moving any
predicted point: the null space of the normal matrix before any prior. An arm's first joint
offset, for one, does the same as a turn of the base's fixtures about that axis.
"""

from dataclasses import dataclass, replace

import numpy as np

from aoicell.calibration.bundle import Solution, normal_equations
from aoicell.calibration.measurement import linearise
from aoicell.calibration.parameters import Layout
from aoicell.calibration.problem import Mask
from aoicell.transforms import Array

# Eigenvalues of the normal matrix, in natural steps, below this share of the largest are
# rounding errors: told parameters come down to about 1e-9 of it.
_NULL = 1e-12


@dataclass(frozen=True)
class Freedom:
    """Parameters that only have a meaning together; `sentence` says so for people.

    `held`: a prior holds at least one of them, so that numbers for the others exist and rest
    on it. Without, they have none.
    """

    parameters: tuple[str, ...]
    held: bool

    @property
    def sentence(self) -> str:
        """One line for a report."""
        first, *others = self.parameters
        blocks = list(dict.fromkeys(_block(name) for name in others))
        if not blocks:
            return f"{first}: nothing that was seen depends on it"
        return f"{first} cannot be told from {', '.join(blocks)}"


def natural_steps(layout: Layout) -> Array:
    """A step of each parameter (P,) that matters about equally: the scaling of all tests."""
    steps = np.full(layout.size, 1e-3)  # m and rad of poses, scale
    for (kind, _), where in layout.blocks.items():
        if kind == "intrinsics":
            steps[where] = [1.0, 1.0, 1.0, 1.0, 1e-2, 1e-1, 1e-3, 1e-3, 1.0][
                : where.stop - where.start
            ]
    return steps


def root_of_inverse(H: Array, step: Array) -> tuple[Array, Mask]:
    """R (P, told) with R R' the pseudo-inverse of a normal matrix, and a mask (P,) of the
    parameters that it does not tell.
    """
    eigenvalues, vectors = np.linalg.eigh(H * np.outer(step, step))
    kept = eigenvalues > _NULL * eigenvalues[-1]
    root = vectors[:, kept] / np.sqrt(eigenvalues[kept]) * step[:, None]
    return root, (vectors[:, ~kept] ** 2).sum(axis=1) > 1e-6


def inverse_of(H: Array, step: Array) -> tuple[Array, Mask]:
    """Pseudo-inverse of a normal matrix, and the mask of `root_of_inverse`."""
    root, lost = root_of_inverse(H, step)
    return root @ root.T, lost


def freedoms(solution: Solution) -> tuple[Freedom, ...]:
    """Each direction that nothing tells, in as few parameters as it takes."""
    layout = solution.layout
    step = natural_steps(layout)
    # With the arm where its model puts it: behind a deviation, a turn of the last joint is not
    # quite the turn of the camera that it is.
    still = replace(solution.estimate, deviations=np.zeros_like(solution.estimate.deviations))
    lin = linearise(solution.problem, layout, still)
    normal = solution.normal  # where only the deviations keep the points in front of the camera
    if lin.in_front:
        normal = normal_equations(layout, still, lin, solution.noise)
    H = normal.information.sum(axis=0) * np.outer(step, step)
    eigenvalues, vectors = np.linalg.eigh(H)
    null = vectors[:, eigenvalues <= _NULL * eigenvalues[-1]].T
    return tuple(
        Freedom(
            tuple(layout.names[i] for i in members),
            bool(np.isfinite(layout.prior[members]).any()),
        )
        for members in _sparse(null, np.isfinite(layout.prior))
    )


def _sparse(null: Array, held: Mask) -> list[list[int]]:
    """Members of each null vector, its own parameter first, after Gauss-Jordan elimination.

    Parameters with a prior (the arm's) are eliminated first: so each freedom names one of them
    and what takes it up.
    """
    rows = null.copy()
    pivots: list[int] = []
    for k in range(len(rows)):
        size = np.abs(rows[k:])
        wanted = size * np.where(held, 1e3, 1.0)
        row, pivot = divmod(int(wanted.argmax()), wanted.shape[1])
        rows[[k, k + row]] = rows[[k + row, k]]
        rows[k] /= rows[k, pivot]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, pivot], rows[k])
        pivots.append(pivot)
    members: list[list[int]] = []
    for vector, own in zip(rows, pivots, strict=True):
        strong = np.flatnonzero(np.abs(vector) > 1e-3 * np.abs(vector).max()).tolist()
        members.append([own, *(i for i in strong if i != own)])
    return sorted(members)


def _block(name: str) -> str:
    """T_flange_hand of 'T_flange_hand rx'; an arm's or a lens's parameter stays whole."""
    return name.rsplit(" ", 1)[0] if name.startswith("T_") else name
