"""What is printed on a component; pictures are (H, W, 3) uint8 RGB."""

import zlib

import cv2
import numpy as np

from aoicell.board import Component
from aoicell.observation import Image


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
