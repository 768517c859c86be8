"""The pictures of a reviewed board: picture, reference and difference, small enough for a page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from aoicell.errors import InputError
from aoicell.report.overlay import Grey, align, difference, warped
from aoicell.report.page_svg import data_uri

LAYERS = ("picture", "reference", "difference")
WIDTH_PX, QUALITY = 800, 65
CROP_PX = 150  # side of a part's surroundings, as they are shown
_LEAST_PX, _GAP_PX = 90, 6  # of the surroundings in the picture; between them in a strip
_MOST_GAIN = 3.0


@dataclass(frozen=True)
class Pictures:
    """A view's layers in full size; `aligned`: the new picture is laid over the reference."""

    layers: tuple[Grey, Grey, Grey]
    aligned: bool


def laid_over(standard: Path, new: Path) -> Pictures:
    """A view's layers from its two pictures. Raises InputError for a file that is no picture."""
    reference, picture = _read(standard), _read(new)
    H = align(picture, reference) if picture.shape == reference.shape else None
    if H is None:
        size = (reference.shape[1], reference.shape[0])
        picture = np.asarray(cv2.resize(picture, size), np.uint8)
        return Pictures((picture, reference, difference(picture, reference, np.eye(3))), False)
    over = warped(picture, H)
    return Pictures((over, reference, difference(over, reference, H)), True)


def embedded(pictures: Pictures) -> dict[str, str]:
    """The layers by name as data URIs, as wide as they are shown."""
    scale = min(1.0, WIDTH_PX / pictures.layers[0].shape[1])
    return {
        name: data_uri(_resized(layer, scale), QUALITY)
        for name, layer in zip(LAYERS, pictures.layers, strict=True)
    }


def _resized(layer: Grey, scale: float) -> Grey:
    small = cv2.resize(layer, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8)


def _read(path: Path) -> Grey:
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise InputError(f"{path}: not a readable picture; run the scenario again")
    return np.asarray(image, np.uint8)


def strip(pictures: Pictures | None, box_px: Sequence[float] | None) -> str:
    """A part's surroundings in the three layers, side by side, as a data URI; "" without a box.

    Picture and reference are made brighter alike where both are dark.
    """
    if pictures is None or box_px is None:
        return ""
    picture, reference, apart = (_crop(layer, box_px) for layer in pictures.layers)
    brightest = float(np.percentile([picture, reference], 99))
    gain = min(_MOST_GAIN, 255 / max(brightest, 1.0))
    gap = np.full((CROP_PX, _GAP_PX), 255, np.uint8)
    crops = [_brighter(picture, gain), gap, _brighter(reference, gain), gap, apart]
    return data_uri(np.hstack(crops), QUALITY)


def _brighter(crop: Grey, gain: float) -> Grey:
    return np.asarray(cv2.convertScaleAbs(crop, alpha=gain), np.uint8)


def _crop(layer: Grey, box_px: Sequence[float]) -> Grey:
    """A square about the box, black beyond the picture's edge."""
    left, top, right, bottom = box_px
    side = round(max(1.5 * (right - left), 1.5 * (bottom - top), _LEAST_PX))
    centre = ((left + right) / 2, (top + bottom) / 2)
    cut = np.zeros((side, side), np.uint8)
    x, y = (round(c - side / 2) for c in centre)
    height, width = layer.shape
    x0, y0, x1, y1 = max(x, 0), max(y, 0), min(x + side, width), min(y + side, height)
    if x0 < x1 and y0 < y1:
        cut[y0 - y : y1 - y, x0 - x : x1 - x] = layer[y0:y1, x0:x1]
    way = cv2.INTER_AREA if side > CROP_PX else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(cut, (CROP_PX, CROP_PX), interpolation=way), np.uint8)
