"""A component cut out of the reference: what moves with it, and the board that stays behind it.

A pixel at its edge is a blend of both. Wherever the component may have gone, the picture of it is
put together anew of the two (a layered model: Wang and Adelson 1994), so that pads and print about
it, which have not moved, say nothing of where it is, and its outline does.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.inspection.bare import BareBoard
from aoicell.inspection.planes import Plane, slopes
from aoicell.inspection.shown import BARE, HOLLOW, Shown
from aoicell.inspection.templates import Template
from aoicell.transforms import Array

_BLUR_PX = 1.0  # sigma: of the picture, and of where the design lies in it
_LEAST = 0.02  # of a component in a pixel, less is none
_MARGIN_PX = 5  # about a component's window, for the blur
_DEEP_PX = 3.0  # farther inside, nothing of the board is seen


class Layer:
    """The edge of a template's component; made once for a reference.

    `edge` (n,): those of the template's pixels that are put together here, m of them; `alphas`
    (m,): the component's share of each.
    """

    def __init__(
        self, template: Template, mean: Plane, bare: BareBoard | None, shown: Shown
    ) -> None:
        """There is no edge where what lies behind is not known or no bare board, nor of a hollow
        component.
        """
        left, top, right, bottom = template.box
        height, width = mean.shape
        rows = slice(max(top - _MARGIN_PX, 0), min(bottom + _MARGIN_PX, height))
        columns = slice(max(left - _MARGIN_PX, 0), min(right + _MARGIN_PX, width))
        self._mean, self._origin = mean, np.array([columns.start, rows.start], np.float32)
        numbers, seen = shown.numbers[rows, columns], mean[rows, columns]
        own = numbers == template.number
        alpha = cv2.GaussianBlur(own.astype(np.float32), (0, 0), _BLUR_PX)
        alpha[alpha < _LEAST] = 0
        on_board = bare is not None and not template.component.on
        beneath = bare.grey[rows, columns] if bare is not None else seen
        covered = (own | (numbers == BARE)) & (alpha > 0)
        self._behind = np.where(covered, beneath, seen).astype(np.float32)
        moving = np.where(alpha > 0, seen - (1 - alpha) * self._behind, 0)
        u, v = (template.uv - self._origin).astype(int).T
        depth = cv2.distanceTransform(own.astype(np.uint8), cv2.DIST_L2, 3)
        hollow = template.component.kind in HOLLOW
        self.edge: NDArray[np.bool_] = (depth[v, u] <= _DEEP_PX) & on_board & (not hollow)
        if bare is not None:
            self.edge &= bare.known[rows, columns][v, u]
        at = (v[self.edge], u[self.edge])
        self.alphas = alpha[at].astype(float)
        self._values = moving[at].astype(float)
        self._slopes, self._alpha_slopes = (
            slopes(plane.astype(np.float32))[at].astype(float) for plane in (moving, alpha)
        )

    def behind(self, uv: NDArray[np.float32]) -> Array:
        """Grey values (m,) of what the edge would cover with its pixels at `uv` (m, 2)."""
        if not len(uv):
            return np.zeros(0)
        at = uv - self._origin
        inside = ((at >= 0) & (at <= np.array(self._behind.shape[::-1]) - 1)).all(axis=1)
        if inside.all():
            return _sampled(self._behind, at)
        return np.where(inside, _sampled(self._behind, at), _sampled(self._mean, uv))

    def values(self, behind: Array) -> Array:
        """Grey values (m,) of the edge over what is behind it."""
        return np.asarray(self._values + (1 - self.alphas) * behind)

    def slopes(self, behind: Array) -> Array:
        """How these change (m, 2) where the component moves by a pixel."""
        return np.asarray(self._slopes - self._alpha_slopes * behind[:, None])


def _sampled(plane: Plane, uv: NDArray[np.float32]) -> Array:
    border = cv2.BORDER_REPLICATE
    at = cv2.remap(plane, uv[:, :1], uv[:, 1:], cv2.INTER_LINEAR, borderMode=border)
    return np.asarray(at[:, 0], float)
