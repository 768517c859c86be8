"""The checks on a board's layout: everything inside the outline, nothing over anything else."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from aoicell.board.design import BoardDesign, Component
from aoicell.errors import ModelError
from aoicell.transforms import Array

REAR_OVERHANG = 0.005  # how far a connector may stand out over the rear (+y) edge
MARKER_CLEARANCE = 0.002
_TOLERANCE = 1e-9


def check_markers(path: Path, board: BoardDesign) -> None:
    """Ids of their own, inside the outline; raises ModelError naming the marker in `path`."""
    seen = {c.id for c in board.components}
    for index, marker in enumerate(board.markers):
        place = f"{path}: 'marker[{index}]'"
        if marker.id in seen:
            raise ModelError(f"{place} has the id {marker.id!r}, which is taken; give it its own")
        seen.add(marker.id)
        if not _inside(marker.plate(), board, rear_overhang=0.0):
            raise ModelError(f"{place}: {marker.id} {_at(marker.x, marker.y)} {_leaves(board)}")


def check_components(path: Path, board: BoardDesign, lines: Mapping[str, int]) -> None:
    """Every footprint inside the outline, clear of the markers and of every other footprint.

    `lines` tells for each id where it stands in the list `path`. Raises ModelError.
    """
    parents = {c.id: c.on for c in board.components}
    plates = [(m.id, m.plate(MARKER_CLEARANCE)) for m in board.markers]
    footprints = {c.id: c.footprint for c in board.components}
    near = _neighbours(board.components)
    for component in board.components:
        place = f"{path}, line {lines[component.id]}: {component.id}"
        corners = footprints[component.id]
        overhang = REAR_OVERHANG if component.kind == "connector" else 0.0
        if not _inside(corners, board, overhang):
            raise ModelError(f"{place} {_at(component.x, component.y)} {_leaves(board)}")
        for marker_id, plate in plates:
            if rectangles_overlap(corners, plate):
                raise ModelError(
                    f"{place} is nearer than {MARKER_CLEARANCE * 1e3:g} mm to marker {marker_id};"
                    " move it away"
                )
        for other in near[component.id]:
            if rectangles_overlap(corners, footprints[other.id]) and not (
                _stands_on(component.id, other.id, parents)
                or _stands_on(other.id, component.id, parents)
            ):
                raise ModelError(
                    f"{place} overlaps {other.id} (line {lines[other.id]}); move one, or name"
                    " in column on what it stands on"
                )


def _neighbours(components: Sequence[Component]) -> dict[str, list[Component]]:
    """For each component those before it in the list that are near enough to overlap with it."""
    centres = np.array([(c.x, c.y) for c in components]).reshape(-1, 2)
    reach = np.array([np.hypot(c.width, c.depth) / 2 for c in components])
    gaps = np.linalg.norm(centres[:, None] - centres[None], axis=2) - reach[:, None] - reach
    return {
        c.id: [components[j] for j in np.flatnonzero(gaps[k, :k] <= _TOLERANCE).tolist()]
        for k, c in enumerate(components)
    }


def rectangles_overlap(a: Array, b: Array) -> bool:
    """Whether two rectangles, (4, 2) corners each, share area; touching edges do not count."""
    for corners in (a, b):  # separating axes: the two edge directions of each
        for edge in (corners[1] - corners[0], corners[3] - corners[0]):
            axis = edge / np.hypot(*edge)
            on_a, on_b = a @ axis, b @ axis
            if on_a.max() <= on_b.min() + _TOLERANCE or on_b.max() <= on_a.min() + _TOLERANCE:
                return False
    return True


def _stands_on(upper: str, lower: str, parents: Mapping[str, str]) -> bool:
    """Whether one component stands, directly or not, on the other."""
    while upper := parents[upper]:
        if upper == lower:
            return True
    return False


def _inside(corners: Array, board: BoardDesign, rear_overhang: float) -> bool:
    half = np.array(board.size[:2]) / 2 + _TOLERANCE
    beyond_rear = np.array([0.0, rear_overhang])
    return bool(np.all(corners >= -half) and np.all(corners <= half + beyond_rear))


def _at(x: float, y: float) -> str:
    return f"at x_mm = {x * 1e3:g}, y_mm = {y * 1e3:g}"


def _leaves(board: BoardDesign) -> str:
    width, depth = board.size[0] * 1e3, board.size[1] * 1e3
    return f"leaves the outline of {width:g} x {depth:g} mm; move it inside"
