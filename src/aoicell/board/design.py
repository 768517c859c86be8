"""A board as designed: its outline, components and markers.

Frame `board`: origin at the centre of the PCB's top surface, z up. Metres and radians.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from aoicell.errors import InputError, did_you_mean
from aoicell.transforms import Array

KINDS = (
    "socket heatsink dimm_slot dimm_module chip connector capacitor resistor inductor screw label"
    " crystal battery led"
).split()
MARKER_ROLES = ("positioning", "measuring")


@dataclass(frozen=True)
class Tolerance:
    """How far a good part may lie from its place: a distance (m), and a turn (rad) either way.

    A turn of pi is every turn: what has no direction.
    """

    shift: float
    rotation: float


# of a part whose list names no class: a quarter of a land of 0.8 mm, a chip part's (IPC-A-610)
DEFAULT_TOLERANCE = Tolerance(shift=0.2e-3, rotation=math.radians(5))


@dataclass(frozen=True)
class Component:
    """One part; `x, y` is the footprint's centre, `z` its underside above the board's surface.

    Its own frame stands at the centre of its underside, turned by `rotation`. `tolerance` names
    a class of the board's; "" for the default one.
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
    tolerance: str = ""

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
    """The whole board; `size` is (x, y, thickness), `colour` the solder mask's RGB in 0..1.

    `tolerances` are the classes that its components name.
    """

    name: str
    size: tuple[float, float, float]
    colour: tuple[float, float, float]
    components: tuple[Component, ...]
    markers: tuple[MarkerDesign, ...]
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict, hash=False)

    def tolerance(self, component: Component) -> Tolerance:
        """How far that component may lie from its place; raises InputError for an unknown class."""
        if not component.tolerance:
            return DEFAULT_TOLERANCE
        if component.tolerance not in self.tolerances:
            hint = did_you_mean(component.tolerance, self.tolerances)
            raise InputError(
                f"board {self.name}: {component.id} names the tolerance class "
                f"{component.tolerance!r}, which there is not; {hint}"
            )
        return self.tolerances[component.tolerance]

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
