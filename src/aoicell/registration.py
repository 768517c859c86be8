"""Template login: the board as it lies when it is taught.

Where its markers are on it, where it is, the inspection poses and their standard images.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.errors import TargetNotFound
from aoicell.observation import Observation
from aoicell.targets.layout import Codes, Layout, LocatedLayout, identify, locate_layout
from aoicell.targets.marker import Marker
from aoicell.targets.marker_sighting import Detection
from aoicell.targets.pose import solve_pose
from aoicell.transforms import SE3, Array, apply, from_rvec, from_xyz_rpy


@dataclass(frozen=True)
class TaughtView:
    """An inspection view as taught: its name and the standard image with its robot state."""

    id: str
    standard: Observation


@dataclass(frozen=True)
class Template:
    """What the online phase needs to know.

    `look` is the observation that located the taught board from the check or overview pose;
    `taught` its result: T_S of the paper when the layout is the one positioning marker.
    `sigma_px` is the noise of a cross centre; `references` pictures of something that stays,
    `board` the design for whoever looks for more than markers.
    """

    layout: Layout
    look: Observation
    taught: LocatedLayout
    views: tuple[TaughtView, ...]
    sigma_px: float = 0.05
    references: tuple[Observation, ...] = ()
    board: BoardDesign | None = None


def register(
    look: Observation,
    detections: Sequence[Detection],
    views: Sequence[TaughtView],
    layout: Layout,
    camera: Camera,
    T_camera_expected: SE3,
    sigma_px: float = 0.05,
    references: tuple[Observation, ...] = (),
    board: BoardDesign | None = None,
    codes: Codes | None = None,
) -> Template:
    """Locate the taught board by the detections in `look` and keep it with the taught views.

    With `codes`, of all markers of the board, they are found by these; see `locate_layout`.
    Raises TargetNotFound when a marker of the layout is not in the picture.
    """
    taught = locate_layout(detections, layout, camera, T_camera_expected, codes=codes)
    return Template(layout, look, taught, tuple(views), sigma_px, references, board)


def component_points(board: BoardDesign, camera: Camera, T_camera_board: SE3) -> Array:
    """Tops of the components (N, 3), in the board's frame, that lie in a picture of the board.

    In a picture of none, the place on the board that the optical axis meets.
    """
    tops = np.array([[c.x, c.y, c.top] for c in board.components]).reshape(-1, 3)
    if len(tops):
        uv = camera.project(tops, T_camera_board)
        inside = ((uv >= 0) & (uv <= [camera.width - 1, camera.height - 1])).all(axis=1)
        if inside.any():
            return tops[inside]
    T = T_camera_board.inverse()
    axis = T.rotation[:, 2]
    return np.array([T.translation - T.translation[2] / axis[2] * axis])


def designed_layout(board: BoardDesign, marker: Marker) -> Layout:
    """Cross centres (4, 3) by marker id in the board's frame, as drawn."""
    return {
        m.id: apply(from_xyz_rpy([m.x, m.y, m.z], [0, 0, m.rotation]), marker.crosses)
        for m in board.markers
    }


def measured_layout(
    detections: Sequence[Sequence[Detection]],
    Ts_camera_expected: Sequence[SE3],
    design: Layout,
    camera: Camera,
    fixed: str,
    codes: Codes | None = None,
) -> tuple[Layout, float]:
    """The layout as several pictures show it: each marker moved and turned in the board's plane.

    The marker `fixed` stays at its design place: it defines the board's frame. A joint
    refinement over all pictures, with the camera poses free, so the arm has no part in it.
    With `codes` the markers are told apart by these; see `locate_layout`. Comes with the standard
    deviation (px) of a coordinate of a cross.
    """
    sightings = []
    for found, expected in zip(detections, Ts_camera_expected, strict=True):
        uvs = identify(found, design, camera, expected, codes=codes)
        if uvs:
            sightings.append((uvs, _start_pose(uvs, design, camera)))
    if not sightings:
        raise TargetNotFound(
            f"registration: no marker of the board is in any of {len(detections)} pictures "
            f"(missing: {', '.join(design)}); bring the board into view of the taught poses"
        )
    free = [id for id in design if id != fixed]

    def moved(x: Array) -> Layout:
        layout = dict(design)
        for k, id in enumerate(free):
            layout[id] = _moved_in_plane(design[id], *x[3 * k : 3 * k + 3])
        return layout

    def residuals(x: Array) -> Array:
        layout, offset = moved(x), 3 * len(free)
        parts = []
        for k, (uvs, start) in enumerate(sightings):
            d = x[offset + 6 * k : offset + 6 * k + 6]
            T = start * from_rvec(d[:3], d[3:])
            parts += [(uv - camera.project(layout[id], T)).ravel() for id, uv in uvs.items()]
        return np.concatenate(parts)

    start = np.zeros(3 * len(free) + 6 * len(sightings))
    solution = least_squares(residuals, start, method="lm", x_scale="jac")
    spare = max(len(solution.fun) - len(solution.x), 1)
    return moved(solution.x), float(np.sqrt((solution.fun**2).sum() / spare))


def _start_pose(uvs: Mapping[str, Array], design: Layout, camera: Camera) -> SE3:
    points = np.concatenate([design[id] for id in uvs])
    return solve_pose(points, np.concatenate(list(uvs.values())), camera).T_camera_target


def _moved_in_plane(points: Array, dx: float, dy: float, turn: float) -> Array:
    centre = points.mean(axis=0)
    motion = from_xyz_rpy(np.add(centre, [dx, dy, 0]), [0, 0, turn])
    return apply(motion, points - centre)
