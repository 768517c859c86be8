"""Is the place of a component bare? What the reference shows around it, shows there as well."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.inspection.matching import Plane
from aoicell.inspection.shown import BARE, Shown
from aoicell.inspection.templates import Template


@dataclass(frozen=True)
class AbsenceConfig:
    """The laminate `around_px` of a component says what bare is: within `sigmas` of its spread and
    `least` grey values. A place is bare when `share` of it is. What stands on another part is
    absent when the picture correlates with the reference by less than `correlation`.
    """

    around_px: int = 12
    sigmas: float = 3.0
    least: float = 6.0
    share: float = 0.5
    correlation: float = 0.3


class Absence:
    """The bare surroundings of a component; made once for a reference."""

    def __init__(self, template: Template, shown: Shown, config: AbsenceConfig) -> None:
        self._t, self._config = template, config
        left, top, right, bottom = template.box
        pad = config.around_px
        rows = slice(max(top - pad, 0), bottom + pad)
        columns = slice(max(left - pad, 0), right + pad)
        bare = shown.numbers[rows, columns] == BARE
        bare = cv2.erode(bare.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
        r, c = np.nonzero(bare)
        self._bare = (r + rows.start, c + columns.start)
        self._inside = template.uv[template.inside].astype(int)
        self._own_share: float | None = None

    def __call__(self, picture: Plane, reference: Plane) -> bool:
        """Whether the component's place is bare in a picture, as in the `reference` it is not."""
        if self._t.component.on or len(self._bare[0]) < 30 or not len(self._inside):
            return self._correlation(picture, reference) < self._config.correlation
        if self._own_share is None:
            self._own_share = self._share(reference)
        share = self._share(picture)
        return share > max(self._config.share, self._own_share + 0.2)

    def _share(self, picture: Plane) -> float:
        """Of the component's place, how much looks like the laminate around it."""
        around = picture[self._bare]
        level = float(np.median(around))
        spread = 1.4826 * float(np.median(np.abs(around - level)))
        off = np.abs(self._values(picture) - level)
        return float((off < max(self._config.sigmas * spread, self._config.least)).mean())

    def _correlation(self, picture: Plane, reference: Plane) -> float:
        uv = self._t.uv.astype(int)
        a, b = (plane[uv[:, 1], uv[:, 0]].astype(float) for plane in (picture, reference))
        return float(np.corrcoef(a, b)[0, 1]) if a.std() > 0 and b.std() > 0 else 0.0

    def _values(self, picture: Plane) -> NDArray[np.float32]:
        return np.asarray(picture[self._inside[:, 1], self._inside[:, 0]], np.float32)
