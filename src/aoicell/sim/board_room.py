"""Where on a board there is room for a part: clear of the others, off the markers, not in the air.

Rectangles are (4, 2) corners in the board's plane (m).
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from aoicell.board import BoardDesign, Component, rectangles_overlap
from aoicell.transforms import Array

CLEARANCE = 1e-4  # between a part that is not at its place and its neighbours (m)
FURTHER = 1e-3  # over an edge than designed, for what stands out there anyway (m)


def carried(board: BoardDesign, id: str) -> tuple[Component, ...]:
    """What stands on a component, directly or not, in the board's order."""
    above = {id}
    found: list[Component] = []
    count = -1
    while count != len(found):
        count = len(found)
        found = [c for c in board.components if c.on in above]
        above |= {c.id for c in found}
    return tuple(found)


def hidden_share(board: BoardDesign, component: Component) -> float:
    """Share of a component's footprint that lies under what stands on it."""
    above = carried(board, component.id)
    if not above:
        return 0.0
    across = [(k + 0.5) / 20 - 0.5 for k in range(20)]
    points = np.array(
        [component.place(u * component.width, v * component.depth) for u in across for v in across]
    )
    under = np.zeros(len(points), bool)
    for upper in above:
        under |= _within(points, upper)
    return float(under.mean())


class Room:
    """A board on which parts are put elsewhere, one after the other.

    Both the designed places and the new ones are taken, those of missing parts too: nothing
    that is wrong hides behind something else that is wrong.
    """

    def __init__(self, board: BoardDesign) -> None:
        self.board = board
        self._owners = [c.id for c in board.components]
        self._taken = [_outline(c) for c in board.components]
        self._plates = [m.plate() for m in board.markers]
        self._carriers = {c.id: c for c in board.components}

    def take(self, component: Component) -> None:
        """From now on this place is taken too."""
        self._owners.append(component.id)
        self._taken.append(_outline(component))

    def free(self, components: Iterable[Component]) -> bool:
        """Whether a component, and what it carries along, could be where they are now."""
        moved = {c.id: c for c in components}
        return all(self._free(c, moved) for c in moved.values())

    def _free(self, component: Component, moved: dict[str, Component]) -> bool:
        related = {*moved, *self._below(component)}
        corners = _outline(component, CLEARANCE)
        if not self._on_the_board(component) or not self._rests(component, moved):
            return False
        others = [t for id, t in zip(self._owners, self._taken, strict=True) if id not in related]
        obstacles = np.array(others + self._plates).reshape(-1, 4, 2)
        low, high = obstacles.min(axis=1), obstacles.max(axis=1)  # boxes first: they are cheap
        near = np.all((low < corners.max(axis=0)) & (high > corners.min(axis=0)), axis=1)
        return not any(rectangles_overlap(corners, obstacle) for obstacle in obstacles[near])

    def _below(self, component: Component) -> list[str]:
        ids = []
        while component.on:
            component = self._carriers[component.on]
            ids.append(component.id)
        return ids

    def _on_the_board(self, component: Component) -> bool:
        """Inside the outline, or hardly further over an edge than it is designed to stand out."""
        design = self._carriers.get(component.id)
        beyond = self._beyond(component)
        allowed = np.zeros(4) if design is None else self._beyond(design)
        return bool(np.all(beyond <= np.where(allowed > 1e-9, allowed + FURTHER, 1e-9)))

    def _beyond(self, component: Component) -> Array:
        """How far (4,) a component stands out over the edges at -x, -y, +x, +y; negative inside."""
        half, corners = np.array(self.board.size[:2]) / 2, _outline(component)
        return np.concatenate([-half - corners.min(axis=0), corners.max(axis=0) - half])

    def _rests(self, component: Component, moved: dict[str, Component]) -> bool:
        """Whether what stands on another part does so still: the smaller within the larger."""
        if not component.on:
            return True
        lower = moved.get(component.on, self._carriers[component.on])
        pair = sorted((component, lower), key=lambda c: c.width * c.depth)
        return bool(_within(pair[0].footprint, pair[1]).all())


def _outline(component: Component, margin: float = 0.0) -> Array:
    """The footprint, grown by a margin on each side; that of a round part does not turn."""
    c = replace(component, rotation=0.0) if component.kind == "screw" else component
    return c.area(0, 0, c.width + 2 * margin, c.depth + 2 * margin)


def _within(points: Array, component: Component) -> np.ndarray:
    """Which points (N, 2) lie over a component's footprint."""
    c, s = np.cos(component.rotation), np.sin(component.rotation)
    local = (points - [component.x, component.y]) @ np.array([[c, -s], [s, c]])
    bound = np.array([component.width, component.depth]) / 2 + 1e-9
    return np.asarray(np.all(np.abs(local) <= bound, axis=1))
