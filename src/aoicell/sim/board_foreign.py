"""What does not belong on a board and lies there all the same; its label says what it is.

All makers take the builder and the object's width, depth and height.
"""

from aoicell.sim.board_connectors import Maker
from aoicell.sim.board_solids import DARK, SILVER, TIN, WHITE, PartBuilder

FOREIGN = "foreign"  # the kind of a component that is none


def add_foreign(b: PartBuilder, w: float, d: float, h: float) -> None:
    """The object that the label names."""
    _OBJECTS[b.c.label](b, w, d, h)


def _solder_ball(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h), TIN, "metal", "ellipsoid")


def _wire(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h), TIN, "metal")


def _washer(b: PartBuilder, w: float, d: float, h: float) -> None:
    """Its hole is so dark as the gap below it."""
    b.disk(0, 0, 0, w, h * 0.98, SILVER)
    b.disk(0, 0, h * 0.9, w * 0.5, h * 0.1, DARK, "matte")


def _scrap(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h), WHITE)


_OBJECTS: dict[str, Maker] = {
    "solder ball": _solder_ball, "wire": _wire, "washer": _washer, "plastic scrap": _scrap,
}  # fmt: skip
