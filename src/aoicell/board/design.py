"""A board as designed: its outline, components and markers.

Frame `board`: origin at the centre of the PCB's top surface, z up. Metres and radians.
"""

import math
from dataclasses import dataclass

import numpy as np

from aoicell.errors import InputError, did_you_mean
from aoicell.transforms import Array

KINDS = (
    "socket heatsink dimm_slot dimm_module chip connector capacitor resistor inductor screw label"
    " crystal battery led"
).split()
MARKER_ROLES = ("positioning", "measuring")


@dataclass(frozen=True)
class Component:
    """One part; `x, y` is the footprint's centre, `z` its underside above the board's surface.

    Its own frame stands at the centre of its underside, turned by `rotation`.
    """

    id: str
    kind: str
    x: float
    y: float
    z: float
    rotation: float
    width: float
    depth: float
    height: float
    label: str
    on: str = ""

    @property
    def footprint(self) -> Array:
        """The four corners in the board's plane, (4, 2), anticlockwise."""
        return self.area(0, 0, self.width, self.depth)

    @property
    def top(self) -> float:
        """Height of the upper side above the board's surface."""
        return self.z + self.height

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Where a point of the component's own frame is on the board."""
        c, s = math.cos(self.rotation), math.sin(self.rotation)
        return self.x + c * x - s * y, self.y + s * x + c * y

    def area(self, x: float, y: float, width: float, depth: float) -> Array:
        """Corners (4, 2) on the board of a rectangle about a point of the component's own frame."""
        return rectangle(*self.place(x, y), self.rotation, width, depth)


@dataclass(frozen=True)
class MarkerDesign:
    """A printed plate; `x, y, z` is the centre of its face, `pitch` the distance of its crosses.

    `code` tells it from others of a kind that bears codes; "" for the first code, or none.
    """

    id: str
    kind: str
    x: float
    y: float
    z: float
    rotation: float
    size: float
    pitch: float
    role: str
    code: str = ""

    def plate(self, margin: float = 0.0) -> Array:
        """Corners (4, 2) of the plate in the board's plane, grown by `margin` on each side."""
        side = self.size + 2 * margin
        return rectangle(self.x, self.y, self.rotation, side, side)


@dataclass(frozen=True)
class BoardDesign:
    """The whole board; `size` is (x, y, thickness), `colour` the solder mask's RGB in 0..1."""

    name: str
    size: tuple[float, float, float]
    colour: tuple[float, float, float]
    components: tuple[Component, ...]
    markers: tuple[MarkerDesign, ...]

    def component(self, id: str) -> Component:
        """The component of that id; raises InputError with the nearest id when there is none."""
        for component in self.components:
            if component.id == id:
                return component
        hint = did_you_mean(id, (c.id for c in self.components))
        raise InputError(f"board {self.name}: there is no component {id!r}; {hint}")


def rectangle(x: float, y: float, rotation: float, width: float, depth: float) -> Array:
    """Corners (4, 2), anticlockwise, of a turned rectangle about (x, y)."""
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, depth / 2]
    c, s = math.cos(rotation), math.sin(rotation)
    corners: Array = half @ np.array([[c, s], [-s, c]]) + [x, y]
    return corners
