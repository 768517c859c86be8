"""One more look: what the corrected views themselves show, against the standard images.

A marker that stands in both pictures of a view tells, with lens and hand-eye out of the game,
by how much the camera still stands off. Few markers in a view tell its tilt badly; what is
believed beforehand, and what the other views show of the same board, makes up for it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aoicell.calibration.cell_model import CellModel
from aoicell.leftover import Drift, Leftover
from aoicell.targets.layout import Layout, match_layout
from aoicell.transforms import SE3, Array, apply


@dataclass(frozen=True)
class Shown:
    """Markers of one view: points (N, 3) in the camera as taught, and how far (N, 2) px they
    stand in the new picture from where the standard image has them.
    """

    points: Array
    moved_px: Array


def compare_markers(
    standard: Sequence[Array],
    new: Sequence[Array],
    layout: Layout,
    model: CellModel,
    T_camera_board: SE3,
    max_gap: float = 0.004,
) -> Shown:
    """The markers that both pictures of a view show, by their detections (4, 2) px.

    `T_camera_board`: the board as taught in this view. Markers farther than `max_gap` (m) from
    where they should be are left out.
    """
    before = match_layout(standard, layout, model.camera, T_camera_board, max_gap)
    after = match_layout(new, layout, model.camera, T_camera_board, max_gap)
    both = [id for id in layout if id in before and id in after]
    if not both:
        return Shown(np.zeros((0, 3)), np.zeros((0, 2)))
    return Shown(
        apply(T_camera_board, np.concatenate([layout[id] for id in both])),
        np.concatenate([after[id] - before[id] for id in both]),
    )


def look_again(
    leftover: Leftover,
    model: CellModel,
    shown: Mapping[int, Shown],
    sigma_px: float,
    drift: Drift,
) -> tuple[Leftover, float]:
    """The belief after the pictures of some views, by their index, and how probable they were.

    What a picture shows contains the arrival of the arm that it was taken after, once; a focal
    length that drifts looks like a distance that has changed, in all views alike.
    """
    seen = [(k, s) for k, s in shown.items() if len(s.points)]
    if not seen:
        return leftover, 1.0
    count = 2 * sum(len(s.points) for _, s in seen)
    H = np.zeros((count, len(leftover.mean)))
    R = 2 * sigma_px**2 * np.eye(count)  # two pictures
    by_focal = np.zeros(count)
    row = 0
    for k, s in seen:
        J, K = model.pixel_derivatives(s.points)
        rows = slice(row, row + len(J))
        H[rows, 6 * k : 6 * k + 6] = J
        R[rows, rows] += J @ leftover.arrival[k] @ J.T
        by_focal[rows] = model.by_focal(K)
        row = rows.stop
    R += np.outer(by_focal, by_focal) * (drift.focal_ppm * 1e-6) ** 2
    return leftover.observed(H, np.concatenate([s.moved_px.ravel() for _, s in seen]), R)
