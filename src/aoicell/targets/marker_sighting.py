"""What the detection of one marker yields."""

from dataclasses import dataclass

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
