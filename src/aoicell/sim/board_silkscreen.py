"""The print on the PCB: solder mask, copper under it, pads, white outlines and ids.

Pictures are (H, W, 3) uint8 RGB with row 0 at the rear (+y) edge and columns along +x.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import BoardDesign, Component
from aoicell.observation import Image
from aoicell.sim.board_solids import Vector, spread
from aoicell.transforms import Array

_PAD: Vector = (176, 172, 158)
_INK: Vector = (214, 214, 206)


class _Sheet:
    """A drawing area in board metres; sixteenth-pixel precision."""

    def __init__(self, board: BoardDesign, pixels_per_mm: float) -> None:
        self.scale = pixels_per_mm * 1e3
        self.width = round(board.size[0] * self.scale)
        self.height = round(board.size[1] * self.scale)
        self.half = np.array([board.size[0], board.size[1]]) / 2
        self.image: Image = np.empty((self.height, self.width, 3), np.uint8)

    def px(self, points: Array) -> NDArray[np.int32]:
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


def _tint(mask: Array, factor: float) -> Vector:
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


def _pads(sheet: _Sheet, c: Component) -> None:
    """Tinned lands: at both ends of a chip part, around a chip's body, rings at a hole."""
    if c.kind == "screw":
        sheet.circle(c.x, c.y, c.width * 0.62, 0, _PAD)
    elif c.kind in ("resistor", "capacitor", "inductor", "crystal", "led"):
        for side in (-1, 1):
            sheet.fill(c.area(side * c.width * 0.5, 0, c.width * 0.3, c.depth * 0.9), _PAD)
    elif c.kind == "chip" and max(c.width, c.depth) < 16.5e-3:
        count = max(3, min(16, round(c.width / 1.1e-3)))
        for t in spread(c.width * 0.84, count):
            for side in (-1, 1):
                y = side * c.depth * 0.5
                sheet.fill(c.area(t, y, c.width * 0.42 / count, 1.2e-3), _PAD)


def _outline(sheet: _Sheet, c: Component) -> None:
    """The white frame and a dot at pin 1."""
    margin = _margin(c)
    if c.kind not in ("screw", "label"):
        if c.kind == "capacitor" and c.height > 3e-3:
            sheet.circle(c.x, c.y, c.width * 0.62, 0.25e-3, _INK)
        else:
            frame = c.area(0, 0, c.width + 2 * margin, c.depth + 2 * margin)
            sheet.line(frame, 0.2e-3, _INK, closed=True)
        if c.kind == "chip":
            x, y = c.place(-c.width / 2 - 1.4e-3, -c.depth / 2 - 1.0e-3)
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
