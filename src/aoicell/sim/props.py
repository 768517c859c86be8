"""Things that do not belong into the cell: they stand ready, unseen, to get in the camera's way."""

import mujoco
import numpy as np

from aoicell.nominal import Nominal
from aoicell.sim.as_built import designed
from aoicell.sim.board_scene import MARKER_THICKNESS, add_board
from aoicell.sim.solids import Face, add_printed_plate, set_pose
from aoicell.transforms import SE3, from_xyz_rpy

PROPS = ("glove", "sleeve", "cable", "patch", "sticker", "other_board")
HULLS, GROUP = 0, 4  # of geoms: what is never drawn, and what is when a prop is out
_LATEX = (0.75, 0.78, 0.85, 1.0)
_CLOTH = (0.12, 0.14, 0.22, 1.0)
_RUBBER = (0.06, 0.06, 0.07, 1.0)


def add_props(spec: mujoco.MjSpec, nominal: Nominal) -> None:
    """Each prop as a body that `World.place` moves. None of them collides."""
    for name, add in (("glove", _glove), ("sleeve", _sleeve), ("cable", _cable)):
        add(spec.worldbody.add_body(name=name, mocap=True))
    marker, colour = nominal.marker, np.array(nominal.board.colour)
    patch = spec.worldbody.add_body(name="patch", mocap=True)
    half = 0.55 * marker.size
    patch.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[half, half, MARKER_THICKNESS / 2],
        pos=[0, 0, -MARKER_THICKNESS / 2], rgba=[*colour, 1.0],
    )  # fmt: skip
    sticker = spec.worldbody.add_body(name="sticker", mocap=True)
    size = (marker.size, marker.size, MARKER_THICKNESS)
    add_printed_plate(spec, sticker, "sticker", marker.print_image(), size, face=Face())
    _add_other_board(spec, nominal)
    for name in PROPS:
        for geom in spec.body(name).geoms:
            geom.contype = geom.conaffinity = 0
            if geom.group != HULLS:
                geom.group = GROUP


def _add_other_board(spec: mujoco.MjSpec, nominal: Nominal) -> None:
    """A board of the same kind, exactly as designed."""
    own = mujoco.MjSpec()
    board = own.worldbody.add_body(name="board")
    add_board(own, board, nominal.board, designed(nominal).Ts_board_marker)
    spec.attach(own, prefix="other_", frame=spec.worldbody.add_frame())
    spec.body("other_board").mocap = True


def _capsule(
    body: mujoco.MjsBody, start: SE3, radius: float, length: float, rgba: tuple[float, ...]
) -> None:
    """From a pose along its x."""
    geom = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[radius, length / 2, 0], rgba=rgba
    )
    set_pose(geom, start * from_xyz_rpy([length / 2, 0, 0], [0, np.pi / 2, 0]))


def _glove(body: mujoco.MjsBody) -> None:
    """A hand in a glove: fingertips about the origin, the arm along -x."""
    for k in range(4):
        _capsule(body, from_xyz_rpy([-0.06, 0.02 * (k - 1.5), 0], [0, 0, 0]), 0.008, 0.07, _LATEX)
    palm = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, size=[0.055, 0.045, 0.015], rgba=_LATEX
    )
    set_pose(palm, from_xyz_rpy([-0.10, 0, 0], [0, 0, 0]))
    _capsule(body, from_xyz_rpy([-0.55, 0, 0], [0, 0, 0]), 0.028, 0.42, _LATEX)


def _sleeve(body: mujoco.MjsBody) -> None:
    """A forearm in a sleeve that reaches across, along x."""
    _capsule(body, from_xyz_rpy([-0.5, 0, 0], [0, 0, 0]), 0.045, 1.0, _CLOTH)


def _cable(body: mujoco.MjsBody) -> None:
    """A cable across, along x, with a bend at the origin."""
    _capsule(body, from_xyz_rpy([0, 0, 0], [0, 0, 0]), 0.003, 0.5, _RUBBER)
    _capsule(body, from_xyz_rpy([0, 0, 0], [0, 0, np.pi - 0.3]), 0.003, 0.5, _RUBBER)
