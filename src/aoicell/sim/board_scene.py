"""Puts the server board, its components and its markers into a MuJoCo specification."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType

import mujoco
import numpy as np

from aoicell.board import BoardDesign, Component, MarkerDesign
from aoicell.observation import Image
from aoicell.sim.as_built import PrintScale, Surfaces, plain_surfaces
from aoicell.sim.board_geometry import board_parts
from aoicell.sim.board_labels import label_image
from aoicell.sim.board_silkscreen import silkscreen_image
from aoicell.sim.board_solids import BLACK, Part
from aoicell.sim.drawing import stream
from aoicell.sim.population import Population
from aoicell.sim.prints import dusty, printed_size
from aoicell.sim.solids import Face, add_printed_plate, set_pose
from aoicell.targets.marker import Marker, make_marker
from aoicell.transforms import SE3, from_xyz_rpy, rotation, translation

MARKER_THICKNESS = 0.0005
CLEARANCE = 1e-4  # least height of a marker's face over the bare board (m)
PART = "part "  # begins the names of what components consist of
COVER = 3e-4  # thickness of what covers a marker's edge (m)
CLEAN = plain_surfaces()
SOLDER_MASK = Face(specular=0.1)
LABEL = Face(specular=0.05)
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
    print_scales: Mapping[str, PrintScale] = MappingProxyType({}),
    surfaces: Surfaces = CLEAN,
    population: Population | None = None,
) -> None:
    """The board with everything on it, in the frame of `body`; markers at the given poses.

    With a population its components are there instead of the designed ones; the bare board, its
    markers and the hull stay as designed.
    """
    for finish, (specular, shininess) in _GLOSS.items():
        spec.add_material(name=finish, specular=specular, shininess=shininess, rgba=[1, 1, 1, 1])
    _add_pcb(spec, body, board, Ts_board_marker, surfaces)
    present = population.board if population else board
    solids = population.parts if population else board_parts(board)
    for component in present.components:
        id, tone = component.id, surfaces.brightness.get(component.id, 1.0)
        parts = mounted(present, component, solids[id], surfaces.heights)
        for index, part in enumerate(parts):
            name = f"{PART}{id}_{index}"
            if part.printed:
                image = _toned(label_image(component), tone)
                half = part.half_size
                T_board_face = _pose(part) * translation(z=half[2])
                size = (2 * half[0], 2 * half[1], 2 * half[2])
                add_printed_plate(
                    spec, body, name, image, size, T_board_face, LABEL, collides=False
                )
            else:
                _add_part(body, part, name, tone)
    for design in board.markers:
        T_board_marker = Ts_board_marker[design.id]
        scale = print_scales.get(design.id, (1.0, 1.0))
        _add_marker(spec, body, design, T_board_marker, scale, surfaces)
    _add_hull(body, board)


def mounted(
    board: BoardDesign, component: Component, parts: Iterable[Part], heights: Mapping[str, float]
) -> Iterator[Part]:
    """The parts of a component that is higher than designed by `heights` (m, by id), and is lifted
    by what carries it; never flatter than a fifth of its design.
    """
    lift = sum(_excess(carrier, heights) for carrier in _carriers(board, component))
    excess = _excess(component, heights)
    for part in parts:
        if lift == 0 and excess == 0:
            yield part
            continue
        stretch = 1 + excess / component.height
        x, y, z = part.centre
        half = (*part.half_size[:2], part.half_size[2] * stretch)
        z = component.z + lift + (z - component.z) * stretch
        yield replace(part, centre=(x, y, z), half_size=half)


def _excess(component: Component, heights: Mapping[str, float]) -> float:
    return max(heights.get(component.id, 0.0), -0.8 * component.height)


def _carriers(board: BoardDesign, component: Component) -> Iterator[Component]:
    """What a component stands on, from the top down to the board."""
    while component.on:
        component = board.component(component.on)
        yield component


def _add_pcb(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, board: BoardDesign,
    Ts_board_marker: Mapping[str, SE3], surfaces: Surfaces,
) -> None:  # fmt: skip
    """The bare board; it gives way where its bow has taken a marker below its own surface."""
    lowest = min((T.translation[2] for T in Ts_board_marker.values()), default=CLEARANCE)
    T_body_face = translation(z=min(0.0, lowest - CLEARANCE))
    face = replace(SOLDER_MASK, glare=surfaces.glare)
    add_printed_plate(spec, body, "pcb", _pcb_picture(board), board.size, T_body_face, face)


@lru_cache(maxsize=4)
def _pcb_picture(board: BoardDesign) -> Image:
    """It takes long to draw, and a board is built again whenever its parts change."""
    image = silkscreen_image(board, 4.0)
    image.flags.writeable = False
    return image


def _add_marker(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, design: MarkerDesign, T_board_marker: SE3,
    scale: PrintScale, surfaces: Surfaces,
) -> None:  # fmt: skip
    """A marker as printed, with the dust on it and what covers part of its edge."""
    marker = make_marker(design.kind, design.size, design.pitch, design.code)
    flat = (marker.size, marker.size)
    rng = stream(*surfaces.seed, -1, f"dust_{design.id}")
    image = dusty(marker.print_image(), flat, surfaces.dust, rng)
    size = (*printed_size(flat, scale), MARKER_THICKNESS)
    face = Face(glare=surfaces.glare)
    add_printed_plate(spec, body, design.id, image, size, T_board_marker, face, collides=False)
    if surfaces.occlusion:
        corner = stream(*surfaces.seed, -1, f"occlusion_{design.id}").integers(4)
        _add_cover(body, marker, T_board_marker * rotation("z", corner * np.pi / 2), surfaces)


def _add_cover(
    body: mujoco.MjsBody, marker: Marker, T_board_corner: SE3, surfaces: Surfaces
) -> None:
    """A dark ribbon across the corner at +x, +y, as wide as it takes to hide the corner.

    It covers the stated share of the outline: the same length of both edges at the corner.
    """
    leg = 2 * surfaces.occlusion * marker.size
    length, width = np.sqrt(2) * leg, leg / np.sqrt(2)
    outer = SE3(np.eye(3), np.array([marker.size / 2, marker.size / 2, 0.0]))
    across = outer * rotation("z", -np.pi / 4) * translation(y=-width / 2)
    cover = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[length / 2, width / 2, COVER / 2], rgba=BLACK,
        material="plastic", group=2, contype=0, conaffinity=0, mass=0,
    )  # fmt: skip
    set_pose(cover, T_board_corner * across * translation(z=COVER / 2))


def _toned(image: Image, tone: float) -> Image:
    """A picture made brighter by a factor."""
    return image if tone == 1 else np.clip(np.rint(image * tone), 0, 255).astype(np.uint8)


def _pose(part: Part) -> SE3:
    return from_xyz_rpy(part.centre, [0, 0, part.yaw])


def _add_part(body: mujoco.MjsBody, part: Part, name: str, tone: float) -> None:
    half = part.half_size
    rgba = [*np.clip(np.array(part.rgba[:3]) * tone, 0, 1), part.rgba[3]]
    geom = body.add_geom(
        name=name, type=_SHAPES[part.shape],
        size=(half[0], half[2], 0) if part.shape == "cylinder" else half,
        rgba=rgba, material=part.finish, group=2, contype=0, conaffinity=0, mass=0,
    )  # fmt: skip
    set_pose(geom, _pose(part))


def _add_hull(body: mujoco.MjsBody, board: BoardDesign) -> None:
    """One box around all components, for collisions."""
    top = max((component.top for component in board.components), default=0.0)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[board.size[0] / 2, board.size[1] / 2, top / 2 + 1e-4],
        pos=[0, 0, top / 2], group=0, mass=0,
    )  # fmt: skip
