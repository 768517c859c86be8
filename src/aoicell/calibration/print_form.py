"""How a print differs from its drawing: its plate is bent and its sheet is stretched.

A flat plate that is bent a little is a surface of second order: two curvatures and a twist. A
printer's feed and drum err apart, so that a print is also longer one way than the other. With
u and v the coordinates over half the print's extent, and planes taken out of the heights, a
point p of the drawing lies at p + B (bend x, bend y, twist, stretch).
"""

import numpy as np

from aoicell.transforms import Array

FORM = ("bend x", "bend y", "twist", "stretch")
_MIN_POINTS = 9  # three each way: fewer do not show a curvature
_BEND = 2e-3  # of half the width: paper on a plate


def has_form(points: Array) -> bool:
    """Whether a target's points (N, 3) are many enough to show that it is bent."""
    x, y = np.ptp(points[:, 0]), np.ptp(points[:, 1])
    return len(points) >= _MIN_POINTS and bool(min(x, y) > 0.1 * max(x, y))


def form_prior(points: Array, size_std: float, flatness_std: float | None) -> Array:
    """Standard deviations (4,) of a form (m, m, m, 1) of points (N, 3)."""
    half = float(np.ptp(points[:, :2], axis=0).max()) / 2
    bend = _BEND * half if flatness_std is None else flatness_std
    return np.array([bend, bend, bend, size_std])


def form_basis(points: Array, at: Array | None = None) -> Array:
    """B (K, 3, 4): how places `at` (K, 3) on a print move with each number of its form.

    The print's own points (N, 3) set what is measured; they are the places where none are given.
    """
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    half = np.abs(points - middle)[:, :2].max(axis=0)

    def surface(where: Array) -> tuple[Array, Array]:
        u, v = ((where - middle)[:, :2] / half).T
        heights = np.column_stack([u * u, v * v, u * v])
        return np.column_stack([np.ones_like(u), u, v]), heights

    plane, heights = surface(points)
    lean = np.linalg.lstsq(plane, heights, rcond=None)[0]
    if at is not None:
        plane, heights = surface(at)
    B = np.zeros((len(plane), 3, 4))
    B[:, 2, :3] = heights - plane @ lean
    B[:, 0, 3], B[:, 1, 3] = half[0] * plane[:, 1] / 2, -half[1] * plane[:, 2] / 2
    return B
