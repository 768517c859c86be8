"""What the detection of one marker yields."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aoicell.transforms import Array


@dataclass(frozen=True, eq=False)
class MarkerSighting:
    """A marker found in a picture: its four points (4, 2) in raw pixels, clockwise.

    `sigma_px` (4,): standard deviation of each point a coordinate, NaN where unknown. `code`: what
    the marker says of itself; the points are then in the print's own order, from its top left.
    None for a marker without a code, whose first point is arbitrary.
    """

    uv_px: Array
    sigma_px: Array
    code: str | None = None


Detection = Array | MarkerSighting  # the points (4, 2) px alone, or with what they say


def points_of(detections: Sequence[Detection]) -> list[Array]:
    """The points (4, 2) px alone."""
    return [d.uv_px if isinstance(d, MarkerSighting) else d for d in detections]


def sightings_of(detections: Sequence[Detection]) -> list[MarkerSighting]:
    """Sightings; points alone say nothing of themselves."""
    return [
        d if isinstance(d, MarkerSighting) else MarkerSighting(d, np.full(4, np.nan))
        for d in detections
    ]
