"""What a component looks like: its solids, by its kind."""

from aoicell.board import BoardDesign, Component
from aoicell.sim.board_connectors import Maker, add_connector
from aoicell.sim.board_foreign import add_foreign
from aoicell.sim.board_solids import (
    BLACK,
    BLUE,
    DARK,
    GREEN,
    GREY,
    SILVER,
    TAN,
    TIN,
    WHITE,
    Part,
    PartBuilder,
    Rgba,
    spread,
)

LED_COLOURS: dict[str, Rgba] = {
    "green": (0.25, 0.85, 0.30, 1),
    "amber": (0.95, 0.60, 0.10, 1),
    "red": (0.90, 0.15, 0.10, 1),
    "blue": (0.20, 0.40, 0.95, 1),
}


def component_parts(component: Component) -> tuple[Part, ...]:
    """The solids of a component, none of them outside its footprint and height."""
    builder = PartBuilder(component)
    _KINDS[component.kind](builder, component.width, component.depth, component.height)
    return tuple(builder.parts)


def board_parts(board: BoardDesign) -> dict[str, tuple[Part, ...]]:
    """The solids of every component, by its id."""
    return {c.id: component_parts(c) for c in board.components}


def _socket(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.6), SILVER, "metal")
    b.box(0, 0, 0, (w * 0.8, d * 0.68, h * 0.9), DARK)
    b.box(0, 0, 0, (w * 0.62, d * 0.5, h), SILVER, "metal")


def _heatsink(b: PartBuilder, w: float, d: float, h: float) -> None:
    """Fins run along y, the way the air goes; four screws in the corners of the larger ones."""
    base, fins = h * 0.14, max(8, min(16, round(w / 4e-3)))
    b.box(0, 0, 0, (w, d, base), GREY, "metal")
    screws = w > 60e-3
    for x in spread(w, fins):
        corner = screws and abs(x) > w * 0.38
        b.box(
            x, 0, base, (w / fins * 0.36, d * (0.74 if corner else 1.0), h - base), SILVER, "metal"
        )
    if screws:
        for sx in (-1, 1):
            for sy in (-1, 1):
                b.disk(sx * w * 0.44, sy * d * 0.44, base, 6.5e-3, h * 0.45, GREY)


def _dimm_slot(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w * 0.95, d, h * 0.86), BLACK if b.c.label.endswith(("1", "3")) else BLUE)
    for side in (-1, 1):
        b.box(side * w * 0.482, 0, 0, (w * 0.036, d * 0.8, h), WHITE)


def _dimm_module(b: PartBuilder, w: float, d: float, h: float) -> None:
    """A thin upright board; its packages show from above as a black row on either side.

    A module of 16 GB has half of them.
    """
    b.box(0, 0, 0, (w, 1.3e-3, h), GREEN)
    thick = (d - 1.3e-3) / 2
    for x in spread(w * 0.97, 2 if b.c.label.startswith("16GB") else 4):
        for side in (-1, 1):
            b.box(x, side * (0.65e-3 + thick / 2), h * 0.2, (w * 0.17, thick, h * 0.66), BLACK)


def _chip(b: PartBuilder, w: float, d: float, h: float) -> None:
    """By size: leadless, small outline (legs on two sides), flat pack (four), ball grid."""
    printed = max(w, d) > 7e-3
    if w / d > 1.2:
        _legs(b, w, d, h, along_x=True, count=3)
        b.box(0, 0, h * 0.12, (w, d * 0.72, h * 0.86), BLACK, "matte", printed=printed)
        _dot(b, -w * 0.42, -d * 0.26, h)
    elif 10e-3 <= w < 16.5e-3:
        _legs(b, w, d, h, along_x=True, count=5)
        _legs(b, w, d, h, along_x=False, count=5)
        b.box(0, 0, h * 0.12, (w * 0.86, d * 0.86, h * 0.86), BLACK, "matte", printed=printed)
        _dot(b, -w * 0.34, -d * 0.34, h)
    elif w >= 16.5e-3:
        b.box(0, 0, 0, (w, d, h * 0.4), GREEN)
        b.box(0, 0, h * 0.4, (w * 0.8, d * 0.8, h * 0.59), DARK, "matte", printed=printed)
        _dot(b, -w * 0.33, -d * 0.33, h)
    else:
        b.box(0, 0, 0, (w, d, h * 0.98), BLACK, "matte", printed=printed)
        _dot(b, -w * 0.32, -d * 0.32, h)


def _legs(b: PartBuilder, w: float, d: float, h: float, along_x: bool, count: int) -> None:
    """Bars right through the body: each one is two legs."""
    for t in spread((w if along_x else d) * 0.84, count):
        pitch = (w if along_x else d) * 0.84 / count
        size = (pitch * 0.5, d, h * 0.3) if along_x else (w, pitch * 0.5, h * 0.3)
        b.box(t if along_x else 0, 0 if along_x else t, 0, size, TIN, "metal")


def _dot(b: PartBuilder, x: float, y: float, h: float) -> None:
    b.disk(x, y, h * 0.9, min(b.c.width, b.c.depth) * 0.1, h * 0.1, GREY, "matte")


def _capacitor(b: PartBuilder, w: float, d: float, h: float) -> None:
    """A can with a black segment at its negative side, or a ceramic block."""
    if h < 3e-3:
        _block(b, w, d, h, TAN)
        return
    b.box(0, 0, 0, (w, d, h * 0.12), BLACK)
    b.disk(0, 0, h * 0.1, w * 0.96, h * 0.88, SILVER)
    b.box(-w * 0.3, 0, h * 0.9, (w * 0.2, d * 0.62, h * 0.1), BLACK, "matte")


def _resistor(b: PartBuilder, w: float, d: float, h: float) -> None:
    _block(b, w, d, h, BLACK)


def _block(b: PartBuilder, w: float, d: float, h: float, body: Rgba) -> None:
    """A chip resistor or capacitor: metal caps with the body between them."""
    b.box(0, 0, 0, (w, d * 0.96, h * 0.94), TIN, "metal")
    b.box(0, 0, 0, (w * 0.56, d, h), body, "matte")


def _inductor(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d * 0.6, h * 0.3), TIN, "metal")
    b.box(0, 0, h * 0.05, (w * 0.94, d, h * 0.95), GREY, "matte")


def _screw(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.disk(0, 0, 0, w, h * 0.3, TIN)
    b.disk(0, 0, h * 0.3, w * 0.8, h * 0.68, SILVER)
    b.box(0, 0, h * 0.9, (w * 0.62, w * 0.11, h * 0.1), BLACK)


def _label(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h), WHITE, "matte", printed=True)


def _crystal(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.35), SILVER, "metal")
    b.box(0, 0, 0, (w * 0.86, d * 0.84, h), TIN, "metal")


def _battery(b: PartBuilder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d * 0.5, h * 0.6), BLACK)
    b.disk(0, 0, 0, d, h * 0.45, BLACK, "plastic")
    b.disk(0, 0, h * 0.45, d * 0.94, h * 0.45, SILVER)
    b.box(w * 0.36, 0, 0, (w * 0.28, d * 0.22, h), TIN, "metal")
    for size in ((d * 0.3, d * 0.06, h * 0.03), (d * 0.06, d * 0.3, h * 0.03)):
        b.box(-w * 0.1, 0, h * 0.9, size, GREY)


def _led(b: PartBuilder, w: float, d: float, h: float) -> None:
    """A lens on a white base; the dark bar is at the cathode."""
    b.box(0, 0, 0, (w, d, h * 0.5), WHITE)
    b.box(-w * 0.41, 0, h * 0.4, (w * 0.18, d, h * 0.15), DARK, "matte")
    colour = LED_COLOURS.get(b.c.label, LED_COLOURS["green"])
    b.box(0, 0, 0, (w * 0.7, d * 0.9, h), colour, "plastic", "ellipsoid")


_KINDS: dict[str, Maker] = {
    "socket": _socket, "heatsink": _heatsink, "dimm_slot": _dimm_slot,
    "dimm_module": _dimm_module, "chip": _chip, "connector": add_connector,
    "capacitor": _capacitor, "resistor": _resistor, "inductor": _inductor, "screw": _screw,
    "label": _label, "crystal": _crystal, "battery": _battery, "led": _led, "foreign": add_foreign,
}  # fmt: skip
