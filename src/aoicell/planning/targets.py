"""What must be seen of each component: features, from the component list.

A feature is a patch on a component's upper side, or on a mesh. Patches follow the board's own
drawing rules (`models/server_board/README.md`): polarity and pin 1 at -x, in the part's own frame.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from aoicell.board import BoardDesign, Component
from aoicell.planning.heights import HeightField
from aoicell.transforms import Array

SAMPLE = 1.5e-3  # distance of the points that stand for a patch (m)
MOST, LEAST = 9, 3  # points along a side of it
TILE = 0.08  # what is longer is shown in pieces, a picture being 240 mm high (m)
_LOW = 3e-3  # a capacitor below this height is a ceramic block without polarity (m)
_LOWER = 1e-3  # what lies this far under the highest point there is covered, not merely rough (m)


@dataclass(frozen=True)
class Patch:
    """Part of a component's upper side: centre and sides as shares of its width and depth.

    `share` of it has to be visible in one picture.
    """

    what: str
    x: float = 0.0
    y: float = 0.0
    width: float = 1.0
    depth: float = 1.0
    share: float = 0.95


TOP = Patch("top")
_CAPS = (Patch("left cap", -0.39, 0, 0.22, 1), Patch("right cap", 0.39, 0, 0.22, 1))
_CAN = Patch("polarity", -0.3, 0, 0.2, 0.62)

# What tells that the right part is there, the right way round. A slot that holds a module shows
# its latches, which have to be shut; a label its print, to the last character.
PATCHES: Mapping[str, tuple[Patch, ...]] = MappingProxyType({
    "socket": (TOP,),
    "heatsink": (TOP,),
    "dimm_slot": (
        Patch("left latch", -0.486, 0, 0.026, 0.8, share=0.8),
        Patch("right latch", 0.486, 0, 0.026, 0.8, share=0.8),
    ),
    "dimm_module": (TOP,),
    "chip": (TOP, Patch("pin 1", -0.36, -0.3, 0.2, 0.2)),
    "connector": (TOP,),
    "capacitor": (TOP, *_CAPS),
    "resistor": (TOP, *_CAPS),
    "inductor": (TOP,),
    "screw": (Patch("head", 0, 0, 0.7, 0.7),),
    "label": (Patch("print", share=1.0),),
    "crystal": (TOP,),
    "battery": (TOP, Patch("plus sign", -0.1, 0, 0.3, 0.3)),
    "led": (TOP, *_CAPS),
})  # fmt: skip


@dataclass(frozen=True)
class Feature:
    """Something to be seen as a whole in one picture, in the frame `board` (m).

    `points` (N, 3) stand for it, of which `share` must be visible; `corners` (M, 3) is all that
    has to lie in the picture, from the part's underside to its top, so that a shift shows too.
    `normal` (3,) points out of the surface.
    """

    target: str
    kind: str
    what: str
    points: Array
    corners: Array
    share: float = 0.95
    normal: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))


@dataclass(frozen=True)
class Hidden:
    """A feature that no direction can show, and why; it does not count."""

    target: str
    what: str
    reason: str


def features_of(board: BoardDesign, heights: HeightField) -> tuple[list[Feature], list[Hidden]]:
    """What must be seen of every component, and what is built over."""
    features, hidden = [], []
    for component in board.components:
        for patch in patches_of(component):
            points = _samples(component, patch)
            over = heights.at(points[:, :2]) > component.top + _LOWER
            over |= np.array([_under(p, component, board) for p in points])
            if over.all():
                hidden.append(Hidden(component.id, patch.what, _covers(component, board)))
                continue
            corners = _corners(component, patch)
            features.append(
                Feature(
                    component.id, component.kind, patch.what, points[~over], corners, patch.share
                )
            )
    return features, hidden


def patches_of(component: Component) -> Iterator[Patch]:
    """The patches of its kind, large ones in pieces; a can has others than a ceramic capacitor."""
    can = component.kind == "capacitor" and component.height >= _LOW
    for patch in (TOP, _CAN) if can else PATCHES[component.kind]:
        yield from _pieces(patch, component)


def _pieces(patch: Patch, component: Component) -> Iterator[Patch]:
    width, depth = patch.width * component.width, patch.depth * component.depth
    along, across = (max(1, math.ceil(side / TILE)) for side in (width, depth))
    count = along * across
    for k in range(count):
        i, j = k % along, k // along
        yield replace(
            patch,
            what=f"{patch.what} {k + 1}/{count}" if count > 1 else patch.what,
            x=patch.x + patch.width * ((i + 0.5) / along - 0.5),
            y=patch.y + patch.depth * ((j + 0.5) / across - 0.5),
            width=patch.width / along,
            depth=patch.depth / across,
        )


def _corners(component: Component, patch: Patch) -> Array:
    """The eight corners (8, 3) of the box under a patch; a small part's box is its patches'."""
    small = max(component.width, component.depth) <= TILE
    p = TOP if small else patch
    x, y = p.x * component.width, p.y * component.depth
    flat = component.area(x, y, p.width * component.width, p.depth * component.depth)
    return np.vstack([
        np.column_stack([flat, np.full(4, height)]) for height in (component.z, component.top)
    ])  # fmt: skip


def _samples(component: Component, patch: Patch) -> Array:
    """Points (N, 3) in the middle of equal cells of a patch."""
    width, depth = patch.width * component.width, patch.depth * component.depth
    along, across = (int(np.clip(np.ceil(s / SAMPLE), LEAST, MOST)) for s in (width, depth))
    xs = patch.x * component.width + width * ((np.arange(along) + 0.5) / along - 0.5)
    ys = patch.y * component.depth + depth * ((np.arange(across) + 0.5) / across - 0.5)
    places = [component.place(x, y) for x in xs for y in ys]
    return np.column_stack([places, np.full(len(places), component.top)])


def _above(component: Component, board: BoardDesign) -> Iterator[Component]:
    """What stands on a component, directly or not."""
    for other in board.components:
        if other.on == component.id:
            yield other
            yield from _above(other, board)


def _under(point: Array, component: Component, board: BoardDesign) -> bool:
    """Whether a point of the upper side lies under something thin that stands on it."""
    return any(_inside(point, other) for other in _above(component, board))


def _inside(point: Array, component: Component) -> bool:
    c, s = np.cos(component.rotation), np.sin(component.rotation)
    x, y = point[0] - component.x, point[1] - component.y
    across, along = abs(c * x + s * y), abs(-s * x + c * y)
    return bool(across < component.width / 2 and along < component.depth / 2)


def _covers(component: Component, board: BoardDesign) -> str:
    above = [other.id for other in _above(component, board)]
    return f"it lies under {' and '.join(above)}" if above else "something taller overhangs it"
