"""What lies on the bare board and does not belong there: spots where the pictures differ."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from aoicell.camera import Camera
from aoicell.inspection.findings import Box, ForeignObject
from aoicell.inspection.planes import Plane, steepness
from aoicell.inspection.shown import BARE
from aoicell.inspection.warping import on_plane
from aoicell.transforms import SE3

_MOST = 0.5  # of a spot
_STEP = 4  # one pixel in so many, each way, tells the light


@dataclass(frozen=True)
class ForeignConfig:
    """A spot is where the smoothed difference exceeds `sigmas` of its noise and `grey` values, over
    more than a line: a square of `least_px` pixels a side. The print on the board is taken to lie
    up to `edge_px` off; spots nearer than `gap_px` are one.
    """

    sigmas: float = 6.0
    grey: float = 6.0
    least_px: int = 2
    edge_px: float = 0.2
    gap_px: int = 6


@dataclass(frozen=True)
class Spot:
    """A patch of a picture that differs: its box, how often it exceeds the limit, and its pixels
    (h, w) in the box.
    """

    box: Box
    strength: float
    mask: NDArray[np.bool_]

    def mostly_in(self, area: NDArray[np.uint8]) -> bool:
        """Whether half of it or more lies in an area (H, W) of the picture."""
        left, top, right, bottom = self.box
        return bool((area[top:bottom, left:right][self.mask] > 0).mean() >= _MOST)


class Foreign:
    """The bare board of a reference; made once."""

    def __init__(
        self, mean: Plane, spread: Plane, numbers: NDArray[np.int16], covered: NDArray[np.bool_],
        config: ForeignConfig,
    ) -> None:  # fmt: skip
        """`covered` (H, W): where components may be, within their tolerances."""
        self._mean, self._config = mean, config
        self._looked_at = (numbers == BARE) & ~covered
        edges = config.edge_px * steepness(np.asarray(cv2.blur(mean, (3, 3)), np.float32))
        self._shot = np.sqrt(mean + 5)
        self._doubt = np.asarray(config.grey + config.sigmas * (edges + spread), np.float32)

    def spots(self, picture: Plane, noise: float, explained: NDArray[np.bool_]) -> list[Spot]:
        """The spots on a picture (H, W) that nothing explains, whatever the light as a whole."""
        step = (slice(None, None, _STEP), slice(None, None, _STEP))
        bare = self._looked_at[step] & ~explained[step]
        ratios = picture[step][bare] / np.maximum(self._mean[step][bare], 1)
        gain = float(np.median(ratios)) if len(ratios) else 1.0
        difference = np.abs(cv2.blur(cv2.scaleAdd(self._mean, -gain, picture), (3, 3)))
        limit = cv2.scaleAdd(self._shot, self._config.sigmas * np.sqrt(noise) / 3, self._doubt)
        excess = cv2.divide(difference, limit)
        seen = (excess > 1) & self._looked_at & ~explained
        square = np.ones((self._config.least_px,) * 2, np.uint8)
        solid = cv2.morphologyEx(seen.astype(np.uint8), cv2.MORPH_OPEN, square)
        if not solid.any():
            return []
        gap = np.ones((self._config.gap_px + 1,) * 2, np.uint8)
        count, labels = cv2.connectedComponents(cv2.dilate(solid, gap), connectivity=8)
        labels[solid == 0] = 0
        found = []
        for label in range(1, count):
            mask = labels == label
            left, top, width, height = cv2.boundingRect(mask.astype(np.uint8))
            window = (slice(top, top + height), slice(left, left + width))
            mask = mask[window]
            strength = float(excess[window][mask].max())
            found.append(Spot((left, top, left + width, top + height), strength, mask))
        return found

    def mask(self, spots: Sequence[Spot], margin: int) -> NDArray[np.uint8]:
        """Where (H, W) the spots are, 1 there, with a margin (px)."""
        mask = np.zeros(self._mean.shape, np.uint8)
        for spot in spots:
            left, top, right, bottom = spot.box
            mask[top:bottom, left:right] |= spot.mask.astype(np.uint8)
        grown = cv2.dilate(mask, np.ones((2 * margin + 1,) * 2, np.uint8)) if spots else mask
        return np.asarray(grown, np.uint8)


def foreign_objects(
    spots: Sequence[Spot], camera: Camera, T_camera_board: SE3, view: str
) -> tuple[ForeignObject, ...]:
    """The spots as objects on the board."""
    found = []
    for spot in spots:
        left, top, right, bottom = spot.box
        corners = np.array([[left, top], [right - 1, bottom - 1]], dtype=float)
        middle = corners.mean(axis=0)
        across = middle + np.array([[0, 0], [right - left, 0], [0, bottom - top]])
        on_board = on_plane(across, 0.0, camera, T_camera_board)
        sides = np.linalg.norm(on_board[1:] - on_board[0], axis=1)
        confidence = float(ndtr(2 * (spot.strength - 1) + 1))
        place = (float(on_board[0, 0]), float(on_board[0, 1]))
        found.append(ForeignObject(place, float(sides.max()), confidence, view, spot.box))
    return tuple(found)
