"""What the bare board beneath the components looks like, from a drawing of it."""

from dataclasses import dataclass

import cv2
import numpy as np

from aoicell.inspection.shown import BARE, Shown
from aoicell.inspection.virtual_picture import BEYOND, Drawing
from aoicell.inspection.warping import Plane

_FEWEST = 100  # bare pixels, of every ninth
_LEVELS = (12, 95)  # percentiles: the laminate and what is printed on it
_CONTRAST = 10.0  # grey values between them, of a board that has print at all


@dataclass(frozen=True)
class BareBoard:
    """What the bare board looks like: grey values (H, W) in the reference's pixels and light, and
    the slopes of what is printed on it.
    """

    grey: Plane
    slopes: Plane


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
    slopes = [cv2.Sobel(grey, cv2.CV_32F, *xy, ksize=1, scale=0.5) for xy in ((1, 0), (0, 1))]
    return BareBoard(grey, np.asarray(cv2.magnitude(*slopes), np.float32))
