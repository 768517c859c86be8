"""What the bare board beneath the components looks like, from a drawing of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aoicell.inspection.planes import Plane, steepness
from aoicell.inspection.shown import BARE, Shown
from aoicell.inspection.virtual_picture import BEYOND, Drawing

_FEWEST = 100  # bare pixels, of every ninth
_LEVELS = (12, 95)  # percentiles: the laminate and what is printed on it
_CONTRAST = 10.0  # grey values between them, of a board that has print at all


@dataclass(frozen=True)
class BareBoard:
    """What the bare board looks like: grey values (H, W) in the reference's pixels and light, how
    steep they are, and where they are `known`: elsewhere the drawing ends.
    """

    grey: Plane
    slopes: Plane
    known: NDArray[np.bool_]


def bare_board(drawing: Drawing, mean: Plane, shown: Shown) -> BareBoard | None:
    """A drawing in the light of the reference `mean` (H, W), as bare places of both have it.

    None where the reference shows too few of them.
    """
    step = (slice(None, None, 3), slice(None, None, 3))
    beyond = drawing.numbers == BEYOND
    drawn = drawing.bare.astype(np.float32)
    bare = (shown.numbers[step] == BARE) & ~beyond[step]
    if bare.sum() < _FEWEST:
        return None
    low, high = np.percentile(drawn[step][bare], _LEVELS)
    dark, bright = np.percentile(mean[step][bare], _LEVELS)
    contrast = high - low > _CONTRAST
    gain = (bright - dark) / (high - low) if contrast else dark / max(low, 1.0)
    grey = (gain * (drawn - low) + dark).astype(np.float32)
    grey[beyond] = dark
    return BareBoard(grey, steepness(grey), ~beyond)
