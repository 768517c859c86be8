"""Where a picture differs because of a component that moved, or is not what it should be."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import Component
from aoicell.inspection.matching import Place
from aoicell.inspection.shown import silhouette
from aoicell.inspection.standard import Standard
from aoicell.inspection.templates import Template

MARGIN_PX = 3  # blur about it
_THROWN_PX = 8  # its shadow and gleam, at most


@dataclass(frozen=True)
class Area:
    """Part of a picture: a window of it, and a mask (h, w) of ones in that."""

    window: tuple[slice, slice]
    mask: NDArray[np.uint8]


def disturbed(
    template: Template, place: Place | None, standard: Standard, thrown: bool = False
) -> Area:
    """The place of a component in a reference, and where it is now, if it was found; with what it
    has `thrown` about it, no farther than it is high.
    """
    component, shown, number = template.component, standard.shown, template.number
    high_px = component.top * template.px_per_m
    margin = MARGIN_PX + (int(min(high_px, _THROWN_PX)) if thrown else 0)
    hulls = [_hull(component, standard)]
    if place is not None:
        x, y = component.x + place.shift[0], component.y + place.shift[1]
        there = replace(component, x=x, y=y, rotation=component.rotation + place.rotation)
        hulls.append(_hull(there, standard))
    corners = np.vstack([*hulls, np.array(template.box).reshape(2, 2) - [[0, 0], [1, 1]]])
    left, top = corners.min(axis=0) - margin
    right, bottom = corners.max(axis=0) + 1 + margin
    height, width = shown.numbers.shape
    rows = slice(max(top, 0), min(bottom, height))
    columns = slice(max(left, 0), min(right, width))
    own = (shown.numbers[rows, columns] == number) | (shown.solids[rows, columns] == number)
    mask = own.astype(np.uint8)
    if place is not None:
        cv2.fillConvexPoly(mask, hulls[-1] - [columns.start, rows.start], 1)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * margin + 1,) * 2)
    return Area((rows, columns), np.asarray(cv2.dilate(mask, disc), np.uint8))


def _hull(component: Component, standard: Standard) -> NDArray[np.int32]:
    """The corners (n, 2) px of the outline of a component's box."""
    corners = silhouette(component, standard.pattern.camera, standard.T_camera_board)
    return np.asarray(np.rint(corners[:, 0]), np.int32)
