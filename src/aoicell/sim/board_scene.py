"""Puts the server board, its components and its markers into a MuJoCo specification."""

from collections.abc import Mapping

import mujoco

from aoicell.board import BoardDesign
from aoicell.sim.board_geometry import board_parts
from aoicell.sim.board_labels import label_image
from aoicell.sim.board_silkscreen import silkscreen_image
from aoicell.sim.board_solids import Part
from aoicell.sim.solids import add_printed_plate, set_pose
from aoicell.targets.cross_marker import CrossMarker
from aoicell.transforms import SE3, from_xyz_rpy, translation

MARKER_THICKNESS = 0.0005
_SHAPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
}
_GLOSS = {"matte": (0.05, 0.1), "plastic": (0.25, 0.35), "metal": (0.55, 0.5)}


def add_board(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    board: BoardDesign,
    Ts_board_marker: Mapping[str, SE3],
) -> None:
    """The board with everything on it, in the frame of `body`; markers at the given poses."""
    for finish, (specular, shininess) in _GLOSS.items():
        spec.add_material(name=finish, specular=specular, shininess=shininess, rgba=[1, 1, 1, 1])
    add_printed_plate(spec, body, "pcb", silkscreen_image(board, 4.0), board.size, specular=0.1)
    for id, parts in board_parts(board).items():
        for index, part in enumerate(parts):
            if part.printed:
                image = label_image(board.component(id))
                half = part.half_size
                face = _pose(part) * translation(z=half[2])
                size = (2 * half[0], 2 * half[1], 2 * half[2])
                name = f"{id}_{index}"
                add_printed_plate(spec, body, name, image, size, face, 0.05, collides=False)
            else:
                _add_part(body, part)
    for design in board.markers:
        marker = CrossMarker(size=design.size, pitch=design.pitch)
        plate = (marker.size, marker.size, MARKER_THICKNESS)
        add_printed_plate(
            spec, body, design.id, marker.print_image(), plate, Ts_board_marker[design.id],
            collides=False,
        )  # fmt: skip
    _add_hull(body, board)


def _pose(part: Part) -> SE3:
    return from_xyz_rpy(part.centre, [0, 0, part.yaw])


def _add_part(body: mujoco.MjsBody, part: Part) -> None:
    half = part.half_size
    geom = body.add_geom(
        type=_SHAPES[part.shape],
        size=(half[0], half[2], 0) if part.shape == "cylinder" else half,
        rgba=part.rgba, material=part.finish, group=2, contype=0, conaffinity=0, mass=0,
    )  # fmt: skip
    set_pose(geom, _pose(part))


def _add_hull(body: mujoco.MjsBody, board: BoardDesign) -> None:
    """One box around all components, for collisions."""
    top = max((component.top for component in board.components), default=0.0)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[board.size[0] / 2, board.size[1] / 2, top / 2 + 1e-4],
        pos=[0, 0, top / 2], group=0, mass=0,
    )  # fmt: skip
