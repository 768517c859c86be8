"""A board as it was populated: with its defects, and with what varies from board to board."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from aoicell.board import BoardDesign, Component
from aoicell.errors import InputError
from aoicell.sim.as_built import Surfaces
from aoicell.sim.board_geometry import component_parts
from aoicell.sim.board_room import Room, carried
from aoicell.sim.board_solids import Part
from aoicell.sim.board_turns import upright, upright_parts
from aoicell.sim.defects import Defect, moved
from aoicell.sim.drawing import stream

_MACHINE = 0.05e-3 / 3  # pick-and-place data sheets: chips and ICs within 50 um at 3 sigma
_PINS = 0.06e-3  # IPC-2222: holes 0.2 mm wider than the pins, uniform within the play
PLACEMENT: Mapping[str, float] = MappingProxyType(
    {
        **dict.fromkeys(("resistor", "capacitor", "inductor", "crystal", "led", "chip"), _MACHINE),
        **dict.fromkeys(("connector", "dimm_slot", "socket", "battery"), _PINS),
        "dimm_module": 0.05e-3,  # assumed: the play between module and latches
        "heatsink": 0.1e-3,  # ISO 273: a 3.4 mm hole around an M3 screw, two of them
        "screw": 0.1e-3,  # likewise
        "label": 0.3e-3,  # assumed: stuck on by hand, with a jig
    }
)


@dataclass(frozen=True)
class Spread:
    """How much good boards differ: sigma, cut off at 3.

    `placement` (m, each axis) by kind of component; both ends scatter as much as the centre, so
    that a part turns by placement over half its longer side. `screws` turn as they like when it
    is true. `brightness`: of a lot, the parts of one kind and label, about that of the taught
    board's. `height` (m): of each component, about the taught one's.
    """

    placement: Mapping[str, float] = field(default_factory=lambda: PLACEMENT)
    screws: bool = True
    brightness: float = 0.05  # assumed, as in the profiles: parts of several makers
    height: float = 0.03e-3  # chip parts' data sheets: 0.1 mm, taken as 3 sigma


TYPICAL_SPREAD = Spread()


@dataclass(frozen=True)
class Scatter:
    """What was drawn for one board, by component id: offsets (x, y; m, board's axes), turns (rad),
    heights (m, added) and brightness (factors). Empty: as designed and as taught.
    """

    offsets: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    turns: Mapping[str, float] = field(default_factory=dict)
    heights: Mapping[str, float] = field(default_factory=dict)
    brightness: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Population:
    """What is on a board: `board` holds the components as they are, foreign objects last, and its
    `parts` are their solids; heights (m, added) and brightness (factors) are relative to those
    of the taught board; `defects` and `design` say what is true.
    """

    design: BoardDesign
    board: BoardDesign
    parts: Mapping[str, tuple[Part, ...]]
    heights: Mapping[str, float]
    brightness: Mapping[str, float]
    defects: tuple[Defect, ...]

    @property
    def good(self) -> tuple[str, ...]:
        """Ids of the designed components that have no defect."""
        wrong = {defect.component for defect in self.defects}
        return tuple(c.id for c in self.design.components if c.id not in wrong)

    def displacement(self, id: str) -> tuple[tuple[float, float], float]:
        """True shift (x, y; m, board's axes) and rotation (rad) of a component against its design.

        Raises InputError when it is not there.
        """
        is_, was = self.board.component(id), self.design.component(id)
        turn = (is_.rotation - was.rotation + np.pi) % (2 * np.pi) - np.pi
        return (is_.x - was.x, is_.y - was.y), float(turn)

    def surfaces(self, taught: Surfaces) -> Surfaces:
        """How the parts look, given how those of the taught board do."""
        heights, brightness = dict(taught.heights), dict(taught.brightness)
        for id, height in self.heights.items():
            heights[id] = heights.get(id, 0.0) + height
        for id, tone in self.brightness.items():
            brightness[id] = brightness.get(id, 1.0) * tone
        return replace(taught, heights=heights, brightness=brightness)


def draw_scatter(
    board: BoardDesign, seed: int, world: int, trial: int, spread: Spread = TYPICAL_SPREAD
) -> Scatter:
    """The benign variation of one board; trial -1 is the taught one.

    Each component has its own stream and each lot (kind and label) too: no draw depends on what
    else is on the board.
    """
    offsets, turns, heights, brightness = {}, {}, {}, {}
    for c in board.components:
        rng = stream(seed, world, trial, f"place_{c.id}")
        x, y, ends, height = np.clip(rng.standard_normal(4), -3, 3)
        sigma = spread.placement.get(c.kind, 0.0)
        offsets[c.id] = (float(sigma * x), float(sigma * y))
        turns[c.id] = float(sigma * ends / (max(c.width, c.depth) / 2))
        if c.kind == "screw" and spread.screws:
            turns[c.id] = float(rng.uniform(-np.pi, np.pi))
        heights[c.id] = float(spread.height * height)
        lot = stream(seed, world, trial, f"lot_{c.kind}_{c.label}").standard_normal()
        brightness[c.id] = float(1 + spread.brightness * np.clip(lot, -3, 3))
    return Scatter(offsets, turns, heights, brightness)


def populated(
    board: BoardDesign, defects: Sequence[Defect] = (), scatter: Scatter | None = None
) -> Population:
    """The board with its defects and its benign variation.

    What has a defect is exactly where its defect says; what is good scatters, and what stands on
    it goes along. Scatter that would push a part into another or over an edge is left out.

    Raises InputError for a defect of a component that the board does not have, or for two of one.
    """
    scatter = scatter or Scatter()
    by_id = _by_component(board, defects)
    placed = {c.id: _placed(c, by_id.get(c.id)) for c in board.components}
    _scatter(board, placed, scatter, set(by_id))
    foreign = [_placed(d.part, d) for d in defects if d.kind == "foreign_object" and d.part]
    present = tuple(c for c in [*placed.values(), *foreign] if c is not None)
    parts = {}
    for c in present:
        defect = by_id.get(c.id)
        if defect is not None and defect.kind == "tombstoned":
            design = board.component(c.id)
            parts[c.id] = upright_parts(design, _end(design, defect))
        else:
            parts[c.id] = component_parts(c)
    return Population(
        design=board,
        board=replace(board, components=present),
        parts=parts,
        heights=scatter.heights,
        brightness=scatter.brightness,
        defects=tuple(defects),
    )


def _by_component(board: BoardDesign, defects: Sequence[Defect]) -> dict[str, Defect]:
    by_id: dict[str, Defect] = {}
    for defect in defects:
        if defect.kind != "foreign_object":
            board.component(defect.component)
        if defect.component in by_id:
            raise InputError(
                f"component {defect.component}: it has two defects, {by_id[defect.component].kind} "
                f"and {defect.kind}; give it one"
            )
        by_id[defect.component] = defect
    for c in board.components:
        if c.on in by_id and by_id[c.on].kind == "missing" and c.id not in by_id:
            raise InputError(
                f"component {c.id}: it stands on {c.on}, which is missing; let it be missing too"
            )
    return by_id


def _placed(component: Component, defect: Defect | None) -> Component | None:
    """The component as its defect leaves it; None when it is missing."""
    if defect is None:
        return component
    if defect.kind == "missing":
        return None
    if defect.kind == "tombstoned":
        return upright(component, _end(component, defect))
    return moved(defect.part or component, defect.shift, defect.rotation)


def _end(component: Component, defect: Defect) -> int:
    """The end, 1 for +x or -1, that a tombstoned component stands on: it is shifted towards it."""
    c, s = np.cos(component.rotation), np.sin(component.rotation)
    return 1 if c * defect.shift[0] + s * defect.shift[1] > 0 else -1


def _scatter(
    board: BoardDesign,
    placed: dict[str, Component | None],
    scatter: Scatter,
    exact: set[str],
) -> None:
    """Move what is good, carriers before what they carry, each where there is room for it."""
    room = Room(board)
    for c in placed.values():
        if c is not None and c.id in exact:
            room.take(c)
    for component in sorted(board.components, key=lambda c: c.z):
        offset = scatter.offsets.get(component.id, (0.0, 0.0))
        turn = scatter.turns.get(component.id, 0.0)
        along = [c.id for c in carried(board, component.id)]
        if component.id in exact or not any((*offset, turn)) or exact.intersection(along):
            continue
        about = placed[component.id]
        assert about is not None  # a missing one has a defect
        group = [placed[id] for id in (component.id, *along)]
        swung = [_swung(c, about, offset, turn) for c in group if c is not None]
        if room.free(swung):
            for c in swung:
                placed[c.id] = c
                room.take(c)


def _swung(c: Component, about: Component, offset: tuple[float, float], turn: float) -> Component:
    """A component turned about the centre of another and shifted."""
    cos, sin = float(np.cos(turn)), float(np.sin(turn))
    x, y = c.x - about.x, c.y - about.y
    shift = (cos * x - sin * y - x + offset[0], sin * x + cos * y - y + offset[1])
    return moved(c, shift, turn)
