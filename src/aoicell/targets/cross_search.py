"""Where markers of four crosses may be in a picture: dark blobs in the shape of a cross, in fours.

One of the four may be missing: something covers it in part, or runs into it. What is found here
is a guess, to be verified and refined in the raw picture.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from cv2.typing import MatLike

from aoicell.observation import Image
from aoicell.targets.cross_pattern import CrossPattern
from aoicell.transforms import Array

WIDE = 1200  # a picture as wide as that (px) is searched at half its size
_CONTRAST = 12  # grey values by which a cross is darker than what surrounds it
_SMALLEST_PX = 9  # extent of a cross
_MOST_CROSSES = 400  # more cross-like blobs than that are a texture


@dataclass(frozen=True, eq=False)
class _Blobs:
    """Cross-like blobs: centres (N, 2) px, and px a metre (N,)."""

    centres: Array
    scales: Array


def find_fours(grey: Image, pattern: CrossPattern) -> Array:
    """Rough centres (K, 4, 2) px, clockwise, of four crosses in a square; complete ones first."""
    wide = grey.shape[1] >= WIDE
    shown = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) if wide else grey
    blobs = _cross_blobs(np.asarray(shown, dtype=np.uint8), pattern)
    fours = np.array(_fours(blobs, pattern)).reshape(-1, 4, 2)
    return (fours + 0.5) * 2 - 0.5 if wide else fours


def _cross_blobs(grey: Image, pattern: CrossPattern) -> _Blobs:
    block = max(31, grey.shape[1] // 16 | 1)
    dark = cv2.adaptiveThreshold(
        grey, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, block, _CONTRAST
    )
    contours, hierarchy = cv2.findContours(dark, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    centres, scales = [], []
    for contour, parent in zip(
        contours, () if hierarchy is None else hierarchy[0][:, 3], strict=True
    ):
        if parent >= 0 or len(contour) < 2 * _SMALLEST_PX:
            continue  # a hole in a blob; a speck
        shape = _as_cross(contour, pattern)
        if shape is not None:
            centres.append(shape[0])
            scales.append(shape[1])
    if len(centres) > _MOST_CROSSES:
        return _Blobs(np.empty((0, 2)), np.empty(0))
    return _Blobs(np.array(centres).reshape(-1, 2), np.array(scales))


def _as_cross(contour: MatLike, pattern: CrossPattern) -> tuple[Array, float] | None:
    """Centre (2,) px and scale (px a metre) of a blob that fills its hull as a cross does."""
    _, _, width, height = cv2.boundingRect(contour)
    if min(width, height) < _SMALLEST_PX or max(width, height) > 2.5 * min(width, height):
        return None
    hull = cv2.convexHull(contour)
    hull_area = cv2.contourArea(hull)
    moments = cv2.moments(contour)
    length, stroke = 2 * pattern.arm, pattern.stroke
    expected_hull = length**2 - (length - stroke) ** 2 / 2
    expected_fill = stroke * (2 * length - stroke) / expected_hull
    if not 0.4 < moments["m00"] / (expected_fill * max(hull_area, 1.0)) < 1.8:
        return None
    centre = np.array([moments["m10"], moments["m01"]]) / moments["m00"]
    around = cv2.moments(hull)
    middle = np.array([around["m10"], around["m01"]]) / around["m00"]
    if np.linalg.norm(centre - middle) > 0.1 * np.sqrt(hull_area):
        return None  # no point symmetry
    return centre, float(np.sqrt(hull_area / expected_hull))


def _fours(blobs: _Blobs, pattern: CrossPattern) -> list[Array]:
    """Parallelograms of four blobs, then those of three whose fourth corner is missing."""
    whole: dict[frozenset[int], Array] = {}
    broken: dict[frozenset[int], Array] = {}
    gaps = np.linalg.norm(blobs.centres[:, None] - blobs.centres, axis=2)
    for corner in range(len(blobs.centres)):
        steps = gaps[corner] / (pattern.pitch * blobs.scales[corner])
        alike = np.abs(np.log(blobs.scales / blobs.scales[corner])) < np.log(1.35)
        near = [int(k) for k in np.flatnonzero((steps > 0.6) & (steps < 1.5) & alike)]
        for index, first in enumerate(near):
            for second in near[index + 1 :]:
                if not _square_enough(blobs.centres[[corner, first, second]]):
                    continue
                opposite = blobs.centres[first] + blobs.centres[second] - blobs.centres[corner]
                reach = 0.15 * pattern.pitch * blobs.scales[corner]
                off = np.linalg.norm(blobs.centres - opposite, axis=1)
                fourth, three = int(off.argmin()), frozenset({corner, first, second})
                if off[fourth] < reach:
                    order = [corner, first, fourth, second]
                    whole[three | {fourth}] = _clockwise(blobs.centres[order])
                else:
                    places = blobs.centres[[corner, first, second]]
                    broken[three] = _clockwise(np.vstack([places, opposite]))
    spare = [uv for three, uv in broken.items() if not any(three < four for four in whole)]
    return [*whole.values(), *spare]


def _square_enough(corner_and_ends: Array) -> bool:
    """Whether two sides from a corner could be those of a square, seen aslant."""
    a, b = corner_and_ends[1:] - corner_and_ends[0]
    long, short = sorted((float(np.hypot(*a)), float(np.hypot(*b))), reverse=True)
    return long < 1.7 * short and abs(a @ b) < 0.5 * long * short


def _clockwise(uv_px: Array) -> Array:
    """Four points in clockwise order as seen in the picture (y is down)."""
    arms = uv_px - uv_px.mean(axis=0)
    ordered: Array = uv_px[np.argsort(np.arctan2(arms[:, 1], arms[:, 0]))]
    return ordered
