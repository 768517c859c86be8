"""What a component looks like: its solids, its print, and the print on the board.

The only place that knows the look of a kind. Everything is in frame `board`, metres and radians;
pictures are (H, W, 3) uint8 RGB with row 0 at the rear (+y) edge and columns along +x.
A local frame stands at the centre of a component's underside, turned with it.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import BoardDesign, Component

Rgba = tuple[float, float, float, float]
Vector = tuple[float, float, float]
Image = NDArray[np.uint8]

BLACK: Rgba = (0.045, 0.045, 0.05, 1)
DARK: Rgba = (0.10, 0.10, 0.11, 1)
GREY: Rgba = (0.30, 0.31, 0.33, 1)
SILVER: Rgba = (0.72, 0.73, 0.75, 1)
TIN: Rgba = (0.80, 0.80, 0.78, 1)
GOLD: Rgba = (0.80, 0.62, 0.22, 1)
WHITE: Rgba = (0.90, 0.89, 0.85, 1)
BLUE: Rgba = (0.08, 0.16, 0.45, 1)
TAN: Rgba = (0.62, 0.49, 0.34, 1)
GREEN: Rgba = (0.05, 0.26, 0.13, 1)
LED_COLOURS: dict[str, Rgba] = {
    "green": (0.25, 0.85, 0.30, 1),
    "amber": (0.95, 0.60, 0.10, 1),
    "red": (0.90, 0.15, 0.10, 1),
    "blue": (0.20, 0.40, 0.95, 1),
}


@dataclass(frozen=True)
class Part:
    """A solid: centre and yaw in the board's frame; half_size is (r, r, h/2) for a cylinder.

    On a `printed` part the picture of `label_image` covers the upper side.
    """

    shape: str  # box | cylinder | ellipsoid
    centre: Vector
    yaw: float
    half_size: Vector
    rgba: Rgba
    finish: str = "matte"  # matte | metal | plastic
    printed: bool = False


class _Builder:
    """Collects the parts of one component; sizes are full sizes, places are local."""

    def __init__(self, component: Component) -> None:
        self.c = component
        self.parts: list[Part] = []

    def box(
        self, x: float, y: float, z: float, size: Vector, rgba: Rgba, finish: str = "plastic",
        shape: str = "box", printed: bool = False,
    ) -> None:  # fmt: skip
        """A solid whose underside is at z above the component's own underside."""
        c = self.c
        cos, sin = math.cos(c.rotation), math.sin(c.rotation)
        centre = (c.x + cos * x - sin * y, c.y + sin * x + cos * y, c.z + z + size[2] / 2)
        half = (size[0] / 2, size[1] / 2, size[2] / 2)
        self.parts.append(Part(shape, centre, c.rotation, half, rgba, finish, printed))

    def disk(
        self, x: float, y: float, z: float, diameter: float, height: float, rgba: Rgba,
        finish: str = "metal",
    ) -> None:  # fmt: skip
        """An upright cylinder."""
        self.box(x, y, z, (diameter, diameter, height), rgba, finish, "cylinder")


def component_parts(component: Component) -> tuple[Part, ...]:
    """The solids of a component, none of them outside its footprint and height."""
    builder = _Builder(component)
    _KINDS[component.kind](builder, component.width, component.depth, component.height)
    return tuple(builder.parts)


def board_parts(board: BoardDesign) -> dict[str, tuple[Part, ...]]:
    """The solids of every component, by its id."""
    return {c.id: component_parts(c) for c in board.components}


def _spread(length: float, count: int) -> list[float]:
    """Centres of `count` equal cells of a length, about 0."""
    return [length * ((k + 0.5) / count - 0.5) for k in range(count)]


# ---- kinds -------------------------------------------------------------------------------------


def _socket(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.6), SILVER, "metal")
    b.box(0, 0, 0, (w * 0.8, d * 0.68, h * 0.9), DARK)
    b.box(0, 0, 0, (w * 0.62, d * 0.5, h), SILVER, "metal")


def _heatsink(b: _Builder, w: float, d: float, h: float) -> None:
    """Fins run along y, the way the air goes; four screws in the corners of the larger ones."""
    base, fins = h * 0.14, max(8, min(16, round(w / 4e-3)))
    b.box(0, 0, 0, (w, d, base), GREY, "metal")
    screws = w > 60e-3
    for x in _spread(w, fins):
        corner = screws and abs(x) > w * 0.38
        b.box(
            x, 0, base, (w / fins * 0.36, d * (0.74 if corner else 1.0), h - base), SILVER, "metal"
        )
    if screws:
        for sx in (-1, 1):
            for sy in (-1, 1):
                b.disk(sx * w * 0.44, sy * d * 0.44, base, 6.5e-3, h * 0.45, GREY)


def _dimm_slot(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w * 0.95, d, h * 0.86), BLACK if b.c.id.endswith(("1", "3")) else BLUE)
    for side in (-1, 1):
        b.box(side * w * 0.482, 0, 0, (w * 0.036, d * 0.8, h), WHITE)


def _dimm_module(b: _Builder, w: float, d: float, h: float) -> None:
    """A thin upright board; its packages show from above as a black row on either side."""
    b.box(0, 0, 0, (w, 1.3e-3, h), GREEN)
    thick = (d - 1.3e-3) / 2
    for x in _spread(w * 0.97, 4):
        for side in (-1, 1):
            b.box(x, side * (0.65e-3 + thick / 2), h * 0.2, (w * 0.17, thick, h * 0.66), BLACK)


def _chip(b: _Builder, w: float, d: float, h: float) -> None:
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


def _legs(b: _Builder, w: float, d: float, h: float, along_x: bool, count: int) -> None:
    """Bars right through the body: each one is two legs."""
    for t in _spread((w if along_x else d) * 0.84, count):
        pitch = (w if along_x else d) * 0.84 / count
        size = (pitch * 0.5, d, h * 0.3) if along_x else (w, pitch * 0.5, h * 0.3)
        b.box(t if along_x else 0, 0 if along_x else t, 0, size, TIN, "metal")


def _dot(b: _Builder, x: float, y: float, h: float) -> None:
    b.disk(x, y, h * 0.9, min(b.c.width, b.c.depth) * 0.1, h * 0.1, GREY, "matte")


def _capacitor(b: _Builder, w: float, d: float, h: float) -> None:
    """A can with a black segment at its negative side, or a ceramic block."""
    if h < 3e-3:
        _block(b, w, d, h, TAN)
        return
    b.box(0, 0, 0, (w, d, h * 0.12), BLACK)
    b.disk(0, 0, h * 0.1, w * 0.96, h * 0.88, SILVER)
    b.box(-w * 0.3, 0, h * 0.9, (w * 0.2, d * 0.62, h * 0.1), BLACK, "matte")


def _resistor(b: _Builder, w: float, d: float, h: float) -> None:
    _block(b, w, d, h, BLACK)


def _block(b: _Builder, w: float, d: float, h: float, body: Rgba) -> None:
    """A chip resistor or capacitor: metal caps with the body between them."""
    b.box(0, 0, 0, (w, d * 0.96, h * 0.94), TIN, "metal")
    b.box(0, 0, 0, (w * 0.56, d, h), body, "matte")


def _inductor(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d * 0.6, h * 0.3), TIN, "metal")
    b.box(0, 0, h * 0.05, (w * 0.94, d, h * 0.95), GREY, "matte")


def _screw(b: _Builder, w: float, d: float, h: float) -> None:
    b.disk(0, 0, 0, w, h * 0.3, TIN)
    b.disk(0, 0, h * 0.3, w * 0.8, h * 0.68, SILVER)
    b.box(0, 0, h * 0.9, (w * 0.62, w * 0.11, h * 0.1), BLACK)


def _label(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h), WHITE, "matte", printed=True)


def _crystal(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.35), SILVER, "metal")
    b.box(0, 0, 0, (w * 0.86, d * 0.84, h), TIN, "metal")


def _battery(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d * 0.5, h * 0.6), BLACK)
    b.disk(0, 0, 0, d, h * 0.45, BLACK, "plastic")
    b.disk(0, 0, h * 0.45, d * 0.94, h * 0.45, SILVER)
    b.box(w * 0.36, 0, 0, (w * 0.28, d * 0.22, h), TIN, "metal")
    for size in ((d * 0.3, d * 0.06, h * 0.03), (d * 0.06, d * 0.3, h * 0.03)):
        b.box(-w * 0.1, 0, h * 0.9, size, GREY)


def _led(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.5), WHITE)
    colour = LED_COLOURS.get(b.c.label, LED_COLOURS["green"])
    b.box(0, 0, 0, (w * 0.7, d * 0.9, h), colour, "plastic", "ellipsoid")


# ---- connectors, by the first word of their label ----------------------------------------------


def _connector(b: _Builder, w: float, d: float, h: float) -> None:
    family = b.c.label.split(" ")[0] if b.c.label else ""
    _CONNECTORS.get(family, _header)(b, w, d, h)


def _pcie(b: _Builder, w: float, d: float, h: float) -> None:
    """The groove with the key's bridge, and the latch at the inner end."""
    b.box(0, 0, 0, (w, d, h * 0.98), BLACK)
    b.box(w * 0.49, 0, 0, (w * 0.02, d * 0.6, h), BLUE)
    for x, length in ((-w * 0.36, 0.2), (w * 0.11, 0.66)):
        b.box(x, 0, h * 0.9, (w * length, d * 0.3, h * 0.1), GREY)


def _power(b: _Builder, w: float, d: float, h: float) -> None:
    """Two rows of square holes in a pale housing, and the latch at its rear."""
    b.box(0, -d * 0.07, 0, (w, d * 0.86, h * 0.98), WHITE)
    columns = max(2, round(w / 4.3e-3))
    for x in _spread(w, columns):
        b.box(x, -d * 0.07, h * 0.9, (w / columns * 0.66, d * 0.66, h * 0.09), DARK)
    b.box(0, -d * 0.07, h * 0.9, (w, d * 0.12, h * 0.1), WHITE)
    b.box(0, d * 0.43, 0, (min(w * 0.3, 9e-3), d * 0.14, h * 0.8), WHITE)


def _io_cage(b: _Builder, w: float, d: float, h: float) -> None:
    """A metal shell, open to the rear, with spring fingers on top."""
    ports = 2 if b.c.label.endswith("x2") and w > 20e-3 else 1
    b.box(0, -d * 0.01, 0, (w, d * 0.98, h * 0.98), SILVER, "metal")
    for x in _spread(w, ports):
        b.box(x, d * 0.4, h * 0.12, (w / ports * 0.8, d * 0.2, h * 0.7), BLACK)
        for dx in (-0.2, 0.2):
            b.box(x + dx * w / ports, d * 0.1, h * 0.9, (w * 0.07, d * 0.5, h * 0.1), GREY, "metal")
    b.box(0, -d * 0.49, h * 0.1, (w * 0.9, d * 0.02, h * 0.6), BLACK)


def _vga(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, -d * 0.2, 0, (w, d * 0.6, h * 0.9), BLUE)
    b.box(0, d * 0.13, 0, (w, d * 0.06, h), SILVER, "metal")
    b.box(0, d * 0.33, h * 0.15, (w * 0.55, d * 0.34, h * 0.7), SILVER, "metal")
    for side in (-1, 1):
        b.box(side * w * 0.41, d * 0.25, h * 0.4, (w * 0.12, d * 0.18, h * 0.4), TIN, "metal")


def _sata(b: _Builder, w: float, d: float, h: float) -> None:
    """The groove is an L: the plug goes in one way only."""
    b.box(0, 0, 0, (w, d, h * 0.98), BLUE if b.c.label[-1:] in "01" else BLACK)
    b.box(0, 0, h * 0.9, (w * 0.72, d * 0.26, h * 0.1), GREY)
    b.box(w * 0.33, -d * 0.2, h * 0.9, (w * 0.06, d * 0.4, h * 0.1), GREY)


def _fan(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.4), WHITE)
    b.box(0, d * 0.42, 0, (w * 0.5, d * 0.16, h), WHITE)
    for x in _spread(w, 4):
        b.box(x, 0, h * 0.4, (0.7e-3, 0.7e-3, h * 0.6), GOLD, "metal")


def _sas(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d, h * 0.97), SILVER, "metal")
    b.box(0, -d * 0.3, h * 0.9, (w * 0.82, d * 0.22, h * 0.1), BLACK)
    b.box(0, d * 0.2, h * 0.9, (w * 0.3, d * 0.3, h * 0.1), GREY, "metal")


def _m2(b: _Builder, w: float, d: float, h: float) -> None:
    b.box(0, 0, 0, (w, d * 0.7, h), BLACK)
    b.box(0, -d * 0.1, 0, (w * 0.92, d * 0.8, h * 0.3), GOLD, "metal")


def _header(b: _Builder, w: float, d: float, h: float) -> None:
    """Two rows of pins in a black base; a box around them when it is wide enough."""
    b.box(0, 0, 0, (w, d, h * 0.3), BLACK)
    for x in _spread(w, max(2, min(5, round(w / 2.54e-3)))):
        for y in (-d * 0.25, d * 0.25):
            b.box(x, y, h * 0.3, (0.7e-3, 0.7e-3, h * 0.7), GOLD, "metal")


_Maker = Callable[[_Builder, float, float, float], None]
_CONNECTORS: dict[str, _Maker] = {
    "PCIE": _pcie, "ATX": _power, "EPS": _power, "RJ45": _io_cage, "USB": _io_cage, "VGA": _vga,
    "SATA": _sata, "FAN": _fan, "SAS": _sas, "SLIM": _sas, "M.2": _m2, "HDR": _header,
}  # fmt: skip
_KINDS: dict[str, _Maker] = {
    "socket": _socket, "heatsink": _heatsink, "dimm_slot": _dimm_slot,
    "dimm_module": _dimm_module, "chip": _chip, "connector": _connector,
    "capacitor": _capacitor, "resistor": _resistor, "inductor": _inductor, "screw": _screw,
    "label": _label, "crystal": _crystal, "battery": _battery, "led": _led,
}  # fmt: skip


# ---- print -------------------------------------------------------------------------------------


def label_image(component: Component, pixels_per_mm: float = 8.0) -> Image:
    """What is printed on a component: black on paper with a barcode, or grey on a chip.

    Rows run against the component's own +y, columns along its +x.
    """
    width = max(8, round(component.width * 1e3 * pixels_per_mm))
    height = max(8, round(component.depth * 1e3 * pixels_per_mm))
    if component.kind != "label":
        return _chip_print(component.label, width, height)
    image = np.full((height, width, 3), 236, np.uint8)
    text_rows = height if height < 60 else height * 45 // 100
    _text(image, component.label, (width * 4 // 100, 0, width * 92 // 100, text_rows), (20, 20, 20))
    if text_rows < height:
        _barcode(image[text_rows : height * 92 // 100, width * 6 // 100 : width * 94 // 100],
                 component.label)  # fmt: skip
    cv2.rectangle(image, (0, 0), (width - 1, height - 1), (150, 150, 150), 1)
    return image


def _chip_print(label: str, width: int, height: int) -> Image:
    image = np.full((height, width, 3), (26, 26, 28), np.uint8)
    lines = [*label.split(" ", 1), f"{zlib.crc32(label.encode()) % 10000:04d} TW"]
    each = height // (len(lines) + 1)
    for n, line in enumerate(lines):
        box = (width // 8, each // 2 + n * each, width * 3 // 4, each)
        _text(image, line, box, (150, 150, 150))
    return image


def _text(
    image: Image, text: str, box: tuple[int, int, int, int], colour: tuple[int, int, int]
) -> None:
    """The text as large as the box (x, y, width, height) allows, centred in it."""
    x, y, width, height = box
    (unit_w, unit_h), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 1.0, 2)
    scale = min(width / max(unit_w, 1), 0.62 * height / max(unit_h, 1))
    origin = (round(x + (width - unit_w * scale) / 2), round(y + (height + unit_h * scale) / 2))
    thickness = max(1, round(2.2 * scale))
    cv2.putText(
        image, text, origin, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, thickness, cv2.LINE_AA
    )


def _barcode(image: Image, text: str) -> None:
    """Bars of one to three modules; a look-alike, no code that a reader could read."""
    bits = "".join(f"{zlib.crc32(f'{text}{n}'.encode()):032b}" for n in range(3))
    module = image.shape[1] / len(bits)
    for n, bit in enumerate(bits):
        if bit == "1":
            image[:, round(n * module) : round((n + 1) * module)] = 25


# ---- silkscreen --------------------------------------------------------------------------------


class _Sheet:
    """A drawing area in board metres; sixteenth-pixel precision."""

    def __init__(self, board: BoardDesign, pixels_per_mm: float) -> None:
        self.scale = pixels_per_mm * 1e3
        self.width = round(board.size[0] * self.scale)
        self.height = round(board.size[1] * self.scale)
        self.half = np.array([board.size[0], board.size[1]]) / 2
        self.image: Image = np.empty((self.height, self.width, 3), np.uint8)

    def px(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        """Board metres (N, 2) to sixteenths of a pixel."""
        flipped = np.asarray(points, float) * [1, -1] + self.half
        return np.round((flipped * self.scale - 0.5) * 16).astype(np.int32)

    def line(self, points: object, width: float, colour: Vector, closed: bool = False) -> None:
        pts = self.px(np.asarray(points))
        thick = max(1, round(width * self.scale))
        cv2.polylines(self.image, [pts], closed, colour, thick, cv2.LINE_AA, 4)

    def fill(self, points: object, colour: Vector) -> None:
        cv2.fillPoly(self.image, [self.px(np.asarray(points))], colour, cv2.LINE_AA, 4)

    def circle(self, x: float, y: float, radius: float, width: float, colour: Vector) -> None:
        centre = self.px(np.array([[x, y]]))[0]
        thick = max(1, round(width * self.scale)) if width > 0 else -1
        radius_px = round(radius * self.scale * 16)
        cv2.circle(
            self.image, (int(centre[0]), int(centre[1])), radius_px, colour, thick, cv2.LINE_AA, 4
        )

    def text(self, x: float, y: float, text: str, height: float, colour: Vector) -> None:
        """Text with its lower left corner at x, y."""
        origin = self.px(np.array([[x, y]]))[0] // 16
        scale = height * self.scale / 21.0
        thick = max(1, round(0.14 * height * self.scale))
        cv2.putText(
            self.image, text, (int(origin[0]), int(origin[1])), cv2.FONT_HERSHEY_SIMPLEX, scale,
            colour, thick, cv2.LINE_AA,
        )  # fmt: skip


def silkscreen_image(board: BoardDesign, pixels_per_mm: float = 4.0) -> Image:
    """The PCB's upper side: solder mask, copper under it, pads, white outlines and ids."""
    sheet = _Sheet(board, pixels_per_mm)
    mask = np.array(board.colour) * 255
    sheet.image[:] = mask.round().astype(np.uint8)
    _pours(sheet, _tint(mask, 1.12))
    _traces(sheet, board, _tint(mask, 1.75), _tint(mask, 0.7))
    for component in board.components:
        if not component.on:
            _pads(sheet, component)
            _outline(sheet, component)
            if not _crowded(component, board.components):
                _silk_id(sheet, component)
    name = board.name.replace("_", " ").upper()
    sheet.text(-sheet.half[0] + 4e-3, -0.54 * sheet.half[1], name, 3e-3, _INK)
    return sheet.image


def _tint(mask: NDArray[np.float64], factor: float) -> Vector:
    r, g, b = np.clip(mask * factor + (factor - 1) * 12, 0, 255).round()
    return (float(r), float(g), float(b))


def _pours(sheet: _Sheet, colour: Vector) -> None:
    """Copper areas: a frame-wide patchwork with bevelled corners."""
    draw = np.random.default_rng(1)
    for _ in range(26):
        x, y = draw.uniform(-sheet.half, sheet.half)
        w, h = draw.uniform(0.012, 0.05, 2)
        cut = 0.25 * min(w, h)
        u, v = np.array([-1, 1, 1, 1, 1, -1, -1, -1]), np.array([-1, -1, -1, 1, 1, 1, 1, -1])
        inner = np.array([1, 1, 0, 0, 1, 1, 0, 0])  # corners cut along x, the others along y
        outline = np.stack([x + u * (w - cut * inner), y + v * (h - cut * (1 - inner))], axis=1)
        sheet.fill(outline, colour)


def _traces(sheet: _Sheet, board: BoardDesign, copper: Vector, gap: Vector) -> None:
    """Buses between neighbouring chips and connectors: parallel lines with 45 degree bends."""
    ends = [c for c in board.components if c.kind in ("chip", "connector", "socket")]
    draw = np.random.default_rng(2)
    for a in ends:
        near = sorted(ends, key=lambda c: math.hypot(c.x - a.x, c.y - a.y))[2:7:2]
        for b in near:
            _bus(sheet, (a.x, a.y), (b.x, b.y), int(draw.integers(3, 9)), copper)
    for _ in range(900):
        x, y = draw.uniform(-sheet.half, sheet.half)
        sheet.circle(x, y, 0.42e-3, 0, copper)
        sheet.circle(x, y, 0.18e-3, 0, gap)


def _bus(
    sheet: _Sheet, a: tuple[float, float], b: tuple[float, float], lines: int, copper: Vector
) -> None:
    dx, dy = b[0] - a[0], b[1] - a[1]
    bend = min(abs(dx), abs(dy))
    sx, sy = math.copysign(1, dx), math.copysign(1, dy)
    straight = (abs(dx) - bend, 0.0) if abs(dx) > abs(dy) else (0.0, abs(dy) - bend)
    for k in range(lines):
        shift = (k - lines / 2) * 1.1e-3
        side = np.array([0, shift]) if straight[0] > 0 else np.array([shift, 0])
        start = np.array(a) + side
        p = start + np.array([sx * straight[0], sy * straight[1]]) / 2
        q = p + np.array([sx * bend, sy * bend])
        sheet.line([start, p, q, np.array(b) + side], 0.28e-3, copper)


_PAD: Vector = (176, 172, 158)
_INK: Vector = (214, 214, 206)


def _pads(sheet: _Sheet, c: Component) -> None:
    """Tinned lands: at both ends of a chip part, around a chip's body, rings at a hole."""
    if c.kind == "screw":
        sheet.circle(c.x, c.y, c.width * 0.62, 0, _PAD)
    elif c.kind in ("resistor", "capacitor", "inductor", "crystal", "led"):
        for side in (-1, 1):
            sheet.fill(_turned(c, side * c.width * 0.5, 0, c.width * 0.3, c.depth * 0.9), _PAD)
    elif c.kind == "chip" and max(c.width, c.depth) < 16.5e-3:
        count = max(3, min(16, round(c.width / 1.1e-3)))
        for t in _spread(c.width * 0.84, count):
            for side in (-1, 1):
                y = side * c.depth * 0.5
                sheet.fill(_turned(c, t, y, c.width * 0.42 / count, 1.2e-3), _PAD)


def _outline(sheet: _Sheet, c: Component) -> None:
    """The white frame and a dot at pin 1."""
    margin = _margin(c)
    if c.kind not in ("screw", "label"):
        if c.kind == "capacitor" and c.height > 3e-3:
            sheet.circle(c.x, c.y, c.width * 0.62, 0.25e-3, _INK)
        else:
            frame = _turned(c, 0, 0, c.width + 2 * margin, c.depth + 2 * margin)
            sheet.line(frame, 0.2e-3, _INK, closed=True)
        if c.kind == "chip":
            x, y = _turned(c, -c.width / 2 - 1.4e-3, -c.depth / 2 - 1.0e-3, 0, 0)[0]
            sheet.circle(x, y, 0.5e-3, 0, _INK)


def _margin(c: Component) -> float:
    return 0.5e-3 if max(c.width, c.depth) < 3e-3 else 0.9e-3


def _silk_id(sheet: _Sheet, c: Component) -> None:
    """The id above the frame; a slot bears its short name."""
    x, y = c.footprint[:, 0].min(), c.footprint[:, 1].max() + _margin(c) + 0.5e-3
    height = 1.3e-3 if max(c.width, c.depth) < 3e-3 else 1.9e-3
    sheet.text(x, y, c.label if c.kind == "dimm_slot" else c.id, height, _INK)


def _crowded(c: Component, others: tuple[Component, ...]) -> bool:
    """Whether a small part stands so near to another that their ids would run together."""
    if max(c.width, c.depth) >= 3e-3:
        return False
    return any(o.kind == c.kind and 0 < math.hypot(o.x - c.x, o.y - c.y) < 3e-3 for o in others)


def _turned(c: Component, x: float, y: float, width: float, depth: float) -> NDArray[np.float64]:
    """Corners (4, 2) of a rectangle in the component's own frame, in the board's frame."""
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, depth / 2] + [x, y]
    cos, sin = math.cos(c.rotation), math.sin(c.rotation)
    corners: NDArray[np.float64] = half @ np.array([[cos, sin], [-sin, cos]]) + [c.x, c.y]
    return corners
