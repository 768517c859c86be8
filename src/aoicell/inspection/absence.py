"""Is the place of a component bare?

Known from a picture of the bare board, drawn from the design: pads and print are there as well.
Without one, what the reference shows around the component should show there.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from aoicell.inspection.bare import BareBoard
from aoicell.inspection.planes import Plane
from aoicell.inspection.shown import BARE, Shown
from aoicell.inspection.templates import Template


@dataclass(frozen=True)
class AbsenceConfig:
    """The laminate `around_px` of a component says what bare is: within `sigmas` of its spread and
    `least` grey values, and where print is drawn, `edge_px` of its slope. A place is bare when
    `share` of it is, or `drawn_share` where the bare board is known. What stands on another part is
    absent when the picture correlates with the reference by less than `correlation`.
    """

    around_px: int = 12
    sigmas: float = 3.0
    least: float = 6.0
    edge_px: float = 0.7
    share: float = 0.5
    drawn_share: float = 0.85
    correlation: float = 0.3


class Absence:
    """The bare surroundings of a component; made once for a reference."""

    def __init__(
        self, template: Template, shown: Shown, config: AbsenceConfig,
        board: BareBoard | None = None,
    ) -> None:  # fmt: skip
        self._t, self._config = template, config
        left, top, right, bottom = template.box
        pad = config.around_px
        rows = slice(max(top - pad, 0), bottom + pad)
        columns = slice(max(left - pad, 0), right + pad)
        bare = shown.numbers[rows, columns] == BARE
        bare = cv2.erode(bare.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
        r, c = np.nonzero(bare)
        self._around = (r + rows.start, c + columns.start)
        inside = template.uv[template.inside].astype(int)
        self._inside = (inside[:, 1], inside[:, 0])
        self._least = config.share if board is None else config.drawn_share
        # without a picture of it, the bare board is as even as its level
        even = np.zeros(1, np.float32)
        self._drawn_around = even if board is None else board.grey[self._around]
        self._drawn = even if board is None else board.grey[self._inside]
        self._blurred = even if board is None else config.edge_px * board.slopes[self._inside]
        self._own_share: float | None = None

    def __call__(self, picture: Plane, reference: Plane) -> bool:
        """Whether the component's place is bare in a picture, as in the `reference` it is not."""
        if self._t.component.on or len(self._around[0]) < 30 or not len(self._inside[0]):
            return self._correlation(picture, reference) < self._config.correlation
        if self._own_share is None:
            self._own_share = self._share(reference)
        share = self._share(picture)
        return share > max(self._least, (1 + self._own_share) / 2)

    def _share(self, picture: Plane) -> float:
        """Of the component's place, how much looks as the laminate around it says."""
        around = picture[self._around] - self._drawn_around
        level = float(np.median(around))
        spread = 1.4826 * float(np.median(np.abs(around - level)))
        off = np.abs(picture[self._inside] - self._drawn - level)
        allowed = max(self._config.sigmas * spread, self._config.least) + self._blurred
        return float((off < allowed).mean())

    def _correlation(self, picture: Plane, reference: Plane) -> float:
        uv = self._t.uv.astype(int)
        a, b = (plane[uv[:, 1], uv[:, 0]].astype(float) for plane in (picture, reference))
        return float(np.corrcoef(a, b)[0, 1]) if a.std() > 0 and b.std() > 0 else 0.0
