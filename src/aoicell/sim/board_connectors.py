"""What a connector looks like: its family is the first word of its label.

All makers take the builder and the component's width, depth and height.
"""

from collections.abc import Callable

from aoicell.sim.board_solids import (
    BLACK,
    BLUE,
    DARK,
    GOLD,
    GREY,
    SILVER,
    TIN,
    WHITE,
    PartBuilder,
    spread,
)

Maker = Callable[[PartBuilder, float, float, float], None]


def add_connector(b: PartBuilder, w: float, d: float, h: float) -> None:
    """The connector of the family that the label begins with; pins where it is none."""
    family = b.c.label.split(" ")[0] if b.c.label else ""
    _FAMILIES.get(family, _header)(b, w, d, h)


def _pcie(b: PartBuilder, w: float, d: float, h: float) -> None:
    """The groove with the key's bridge, and the latch at the inner end."""
    b.box(0, 0, 0, (w, d, h * 0.98), BLACK)
    b.box(w * 0.49, 0, 0, (w * 0.02, d * 0.6, h), BLUE)
    for x, length in ((-w * 0.36, 0.2), (w * 0.11, 0.66)):
        b.box(x, 0, h * 0.9, (w * length, d * 0.3, h * 0.1), GREY)


def _power(b: PartBuilder, w: float, d: float, h: float) -> None:
    """Two rows of square holes in a pale housing, and the latch at its rear."""
    b.box(0, -d * 0.07, 0, (w, d * 0.86, h * 0.98), WHITE)
    columns = max(2, round(w / 4.3e-3))
    for x in spread(w, columns):
        b.box(x, -d * 0.07, h * 0.9, (w / columns * 0.66, d * 0.66, h * 0.09), DARK)
    b.box(0, -d * 0.07, h * 0.9, (w, d * 0.12, h * 0.1), WHITE)
    b.box(0, d * 0.43, 0, (min(w * 0.3, 9e-3), d * 0.14, h * 0.8), WHITE)


def _io_cage(b: PartBuilder, w: float, d: float, h: float) -> None:
    """A metal shell, open to the rear, with spring fingers on top."""
    ports = 2 if b.c.label.endswith("x2") and w > 20e-3 else 1
    b.box(0, -d * 0.01, 0, (w, d * 0.98, h * 0.98), SILVER, "metal")
    for x in spread(w, ports):
        b.box(x, d * 0.4, h * 0.12, (w / ports * 0.8, d * 0.2, h * 0.7), BLACK)
        for dx in (-0.2, 0.2):
            b.box(x + dx * w / ports, d * 0.1, h * 0.9, (w * 0.07, d * 0.5, h * 0.1), GREY, "metal")
    b.box(0, -d * 0.49, h * 0.1, (w * 0.9, d * 0.02, h * 0.6), BLACK)


def _vga(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, -d * 0.2, 0, (w, d * 0.6, h * 0.9), BLUE)
    b.box(0, d * 0.13, 0, (w, d * 0.06, h), SILVER, "metal")
    b.box(0, d * 0.33, h * 0.15, (w * 0.55, d * 0.34, h * 0.7), SILVER, "metal")
    for side in (-1, 1):
        b.box(side * w * 0.41, d * 0.25, h * 0.4, (w * 0.12, d * 0.18, h * 0.4), TIN, "metal")


def _sata(b: PartBuilder, w: float, d: float, h: float) -> None:
    """The groove is an L: the plug goes in one way only."""
    b.box(0, 0, 0, (w, d, h * 0.98), BLUE if b.c.label[-1:] in "01" else BLACK)
    b.box(0, 0, h * 0.9, (w * 0.72, d * 0.26, h * 0.1), GREY)
    b.box(w * 0.33, -d * 0.2, h * 0.9, (w * 0.06, d * 0.4, h * 0.1), GREY)


def _fan(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.4), WHITE)
    b.box(0, d * 0.42, 0, (w * 0.5, d * 0.16, h), WHITE)
    for x in spread(w, 4):
        b.box(x, 0, h * 0.4, (0.7e-3, 0.7e-3, h * 0.6), GOLD, "metal")


def _sas(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.97), SILVER, "metal")
    b.box(0, -d * 0.3, h * 0.9, (w * 0.82, d * 0.22, h * 0.1), BLACK)
    b.box(0, d * 0.2, h * 0.9, (w * 0.3, d * 0.3, h * 0.1), GREY, "metal")


def _m2(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d * 0.7, h), BLACK)
    b.box(0, -d * 0.1, 0, (w * 0.92, d * 0.8, h * 0.3), GOLD, "metal")


def _header(b: PartBuilder, w: float, d: float, h: float) -> None:
    """Two rows of pins in a black base; a box around them when it is wide enough."""
    b.box(0, 0, 0, (w, d, h * 0.3), BLACK)
    for x in spread(w, max(2, min(5, round(w / 2.54e-3)))):
        for y in (-d * 0.25, d * 0.25):
            b.box(x, y, h * 0.3, (0.7e-3, 0.7e-3, h * 0.7), GOLD, "metal")


_FAMILIES: dict[str, Maker] = {
    "PCIE": _pcie, "ATX": _power, "EPS": _power, "RJ45": _io_cage, "USB": _io_cage, "VGA": _vga,
    "SATA": _sata, "FAN": _fan, "SAS": _sas, "SLIM": _sas, "M.2": _m2, "HDR": _header,
}  # fmt: skip
