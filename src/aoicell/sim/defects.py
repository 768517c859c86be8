"""Draws what can be wrong with a populated board, and says what is true of it.

Every defect is a real one: it could have happened (nothing stands in a neighbour, in the air or
beyond the edge), it can be seen (nothing lies under another part or on a marker), and it is more
than a turn into what looks the same.

- missing: every component, with what stands on it.
- shifted, rotated: all that is soldered, glued or clamped, with what stands on it. Not screws and
  modules, which hole and slot hold, and not what is covered by more than two thirds.
- tombstoned: chip parts with two ends, to 3.2 mm. Solder cannot lift heavier ones.
- wrong_part: all that carries nothing; what stands on a wrong part would not have been fitted.
- swapped_polarity: cans, lamps, chips, batteries and connectors whose half turn shows, and which
  carry nothing. The rest has no polarity, or looks the same from both sides.
- foreign_object: the bare board, off components and markers.

A socket under its cooler can only be missing, along with the cooler.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np

from aoicell.board import BoardDesign, Component
from aoicell.errors import InputError, did_you_mean
from aoicell.sim.board_foreign import FOREIGN
from aoicell.sim.board_room import Room, carried, hidden_share
from aoicell.sim.board_turns import looks_alike, upright
from aoicell.sim.wrong_parts import wrong_part

DefectKind = Literal[
    "missing", "shifted", "rotated", "tombstoned", "wrong_part", "swapped_polarity",
    "foreign_object",
]  # fmt: skip
DEFECT_KINDS: tuple[DefectKind, ...] = get_args(DefectKind)
SHIFT = (0.1e-3, 5e-3)  # m
ROTATION = (float(np.radians(1)), float(np.pi))  # rad, either way
LONGEST_TOMBSTONE = 3.2e-3  # 1206
MOST_HIDDEN = 2 / 3  # share of a component under others, above which it is not seen to move
TRIES = 10  # of a kind of defect that no component has room for, before it is given up
DIRECTIONS = 16  # that are tried before another component is
_TWO_ENDS = ("resistor", "capacitor", "led")
_HELD = ("screw", "dimm_module")
_POLAR = ("capacitor", "led", "chip", "battery", "connector")
Rng = np.random.Generator


@dataclass(frozen=True)
class Defect:
    """What is true of a component that is not as designed.

    `component` is its id, or a foreign object's own. It was moved by `shift` (x, y; m, along the
    board's axes, of the footprint's centre) and turned by `rotation` (rad, anticlockwise, in
    (-pi, pi]) about it; 0 where that means nothing. A tombstoned part moves on to the pad of the
    end that it stands on. A foreign object is moved and turned from the board's centre. What
    looks alike in n ways (`looks_alike`) shows its rotation but for multiples of 2 pi / n.
    `part` is the wrong part, in the design's place, or the foreign object, at the board's centre.
    """

    kind: DefectKind
    component: str
    shift: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    detail: str = ""
    part: Component | None = None


def moved(component: Component, shift: Sequence[float], rotation: float) -> Component:
    """The component shifted (x, y; m, board's axes) and turned (rad) about its own centre."""
    return replace(
        component,
        x=component.x + shift[0],
        y=component.y + shift[1],
        rotation=component.rotation + rotation,
    )


def draw_defects(
    board: BoardDesign, rng: Rng, count: int, kinds: Sequence[DefectKind] = DEFECT_KINDS
) -> tuple[Defect, ...]:
    """`count` defects, at most one a component; each says what is true of one component.

    Kinds of defects are as likely as each other, and so are the components that one fits. What
    stands on a missing part is missing too, what stands on a moved one moves with it; each is a
    defect of its own, and counts. Shifts (0.1 to 5 mm) and rotations (1 to 180 deg) are
    log-uniform: near the tolerances, where detection is decided, there are as many as far above.
    They are drawn before the component, which is then one that has room for it: crowded places
    do not make them smaller.

    Raises InputError for an unknown kind, or when the board has no room for so many.
    """
    for kind in kinds:
        if kind not in DEFECT_KINDS:
            raise InputError(f"defect kind {kind!r}: {did_you_mean(kind, DEFECT_KINDS)}")
    drawing = _Drawing(board, rng)
    tries = dict.fromkeys(kinds, TRIES)
    while tries and len(drawing.defects) < count:
        kind = list(tries)[int(rng.integers(len(tries)))]
        if not drawing.add(kind, count - len(drawing.defects)):
            tries[kind] -= 1
            if not tries[kind]:
                del tries[kind]
    if len(drawing.defects) < count:
        raise InputError(
            f"board {board.name}: {count} defects of the kinds {', '.join(kinds) or '(none)'} were "
            f"asked for, and it has room for {len(drawing.defects)}; ask for fewer"
        )
    return tuple(drawing.defects)


class _Drawing:
    """A board on the way to its defects."""

    def __init__(self, board: BoardDesign, rng: Rng) -> None:
        self.board, self.rng, self.room = board, rng, Room(board)
        self.defects: list[Defect] = []
        self._above = {c.id: carried(board, c.id) for c in board.components}
        self._spoilt: set[str] = set()

    def add(self, kind: DefectKind, most: int) -> bool:
        """Draw one more defect of a kind, `most` at most with what goes along; False: none fits."""
        drawn = _DRAWN[kind](self, most)
        self.defects += drawn
        self._spoilt |= {defect.component for defect in drawn}
        return bool(drawn)

    def candidates(self, fits: Callable[[Component], bool], most: int) -> Iterable[Component]:
        """Components that are still good with all that they carry, `most` at most together, in
        random order.
        """
        components = self.board.components
        for index in self.rng.permutation(len(components)):
            c = components[index]
            group = {c.id, *(upper.id for upper in self._above[c.id])}
            if len(group) <= most and not group & self._spoilt and fits(c):
                yield c

    # -- one method a kind of defect --

    def missing(self, most: int) -> list[Defect]:
        for c in self.candidates(lambda _: True, most):
            along = [
                Defect("missing", upper.id, detail=f"with {c.id}") for upper in self._above[c.id]
            ]
            return [Defect("missing", c.id), *along]
        return []

    def shifted(self, most: int) -> list[Defect]:
        length = _log_uniform(self.rng, *SHIFT)
        for c in self.candidates(self._moves, most):
            for angle in self.rng.uniform(0, 2 * np.pi, DIRECTIONS):
                shift = (float(length * np.cos(angle)), float(length * np.sin(angle)))
                if found := self._moved("shifted", c, shift, 0.0):
                    return found
        return []

    def rotated(self, most: int) -> list[Defect]:
        turn = _log_uniform(self.rng, *ROTATION) * float(self.rng.choice([-1.0, 1.0]))
        for c in self.candidates(self._moves, most):
            alike = 2 * np.pi / looks_alike(c)
            if abs((turn + alike / 2) % alike - alike / 2) < ROTATION[0]:
                continue  # nearly a turn into what looks the same
            for sign in (1.0, -1.0):
                if found := self._moved("rotated", c, (0.0, 0.0), sign * turn):
                    return found
        return []

    def tombstoned(self, most: int) -> list[Defect]:
        for c in self.candidates(self._lifts, most):
            for end in self.rng.permutation([-1, 1]):
                stood = upright(c, int(end))
                if self.room.free([stood]):
                    self.room.take(stood)
                    shift = (stood.x - c.x, stood.y - c.y)
                    detail = f"stands on its {'+' if end > 0 else '-'}x end"
                    return [Defect("tombstoned", c.id, shift, detail=detail)]
        return []

    def wrong_part(self, most: int) -> list[Defect]:
        for c in self.candidates(self._bare, most):
            part, detail = wrong_part(self.board, c, self.rng)
            return [Defect("wrong_part", c.id, detail=detail, part=part)]
        return []

    def swapped_polarity(self, most: int) -> list[Defect]:
        for c in self.candidates(self._is_polar, most):
            return [Defect("swapped_polarity", c.id, rotation=float(np.pi))]
        return []

    def foreign_object(self, most: int) -> list[Defect]:
        number = sum(defect.kind == "foreign_object" for defect in self.defects) + 1
        taken = {c.id for c in self.board.components} | {m.id for m in self.board.markers}
        id = next(name for n in range(number, 10**6) if (name := f"FOREIGN_{n}") not in taken)
        part = _foreign_part(id, self.rng)
        half = np.array(self.board.size[:2]) / 2
        for _ in range(400):
            x, y = self.rng.uniform(-half, half)
            turn = float(self.rng.uniform(-np.pi, np.pi))
            lying = moved(part, (float(x), float(y)), turn)
            if self.room.free([lying]):
                self.room.take(lying)
                size = f"{part.width * 1e3:.1f} x {part.depth * 1e3:.1f} mm"
                detail = f"{part.label if part.kind == FOREIGN else 'loose ' + part.kind}, {size}"
                return [Defect("foreign_object", id, (lying.x, lying.y), turn, detail, part)]
        return []

    # -- what fits what --

    def _bare(self, c: Component) -> bool:
        return not self._above[c.id]

    def _moves(self, c: Component) -> bool:
        return c.kind not in _HELD and hidden_share(self.board, c) <= MOST_HIDDEN

    def _lifts(self, c: Component) -> bool:
        long = max(c.width, c.depth)
        return c.kind in _TWO_ENDS and self._bare(c) and c.width == long <= LONGEST_TOMBSTONE

    def _is_polar(self, c: Component) -> bool:
        return c.kind in _POLAR and self._bare(c) and looks_alike(c) == 1

    def _moved(
        self, kind: DefectKind, c: Component, shift: tuple[float, float], turn: float
    ) -> list[Defect]:
        """A component moved with what it carries; none when there is no room."""
        found, places = [Defect(kind, c.id, shift, turn)], [moved(c, shift, turn)]
        for upper in self._above[c.id]:
            arm = np.array([upper.x - c.x, upper.y - c.y])
            cos, sin = np.cos(turn), np.sin(turn)
            swung = np.array([[cos, -sin], [sin, cos]]) @ arm - arm + shift
            along = (float(swung[0]), float(swung[1]))
            places.append(moved(upper, along, turn))
            found.append(Defect(kind, upper.id, along, turn, f"with {c.id}"))
        if not self.room.free(places):
            return []
        for place in places:
            self.room.take(place)
        return found


_DRAWN: Mapping[DefectKind, Callable[[_Drawing, int], list[Defect]]] = MappingProxyType(
    {
        "missing": _Drawing.missing,
        "shifted": _Drawing.shifted,
        "rotated": _Drawing.rotated,
        "tombstoned": _Drawing.tombstoned,
        "wrong_part": _Drawing.wrong_part,
        "swapped_polarity": _Drawing.swapped_polarity,
        "foreign_object": _Drawing.foreign_object,
    }
)


def _foreign_part(id: str, rng: Rng) -> Component:
    """Something that falls on boards, in a size that it comes in (m), at the board's centre."""
    what = ("solder ball", "wire", "washer", "plastic scrap", "screw", "resistor")[rng.integers(6)]
    width, depth, height = {
        "solder ball": (s := rng.uniform(0.6e-3, 1.2e-3), s, 0.9 * s),  # sits a little flattened
        "wire": (rng.uniform(4e-3, 12e-3), 0.5e-3, 0.5e-3),
        "washer": (6e-3, 6e-3, 0.5e-3),  # M2.5
        "plastic scrap": (rng.uniform(2e-3, 8e-3), rng.uniform(1e-3, 3e-3), 0.3e-3),
        "screw": (5e-3, 5e-3, 2e-3),  # M2.5, on its head's rim
        "resistor": (1.6e-3, 0.8e-3, 0.5e-3),
    }[what]
    known = what in ("screw", "resistor")
    return Component(
        id=id, kind=what if known else FOREIGN, x=0.0, y=0.0, z=0.0, rotation=0.0,
        width=float(width), depth=float(depth), height=float(height), label=what,
    )  # fmt: skip


def _log_uniform(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
