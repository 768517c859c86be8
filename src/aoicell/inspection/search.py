"""Where a component may have gone: its template tried in many places of a picture at once.

Few pixels, in a grid of shifts and in all turns; where they differ least, the fine match judges.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.inspection.matching import Place
from aoicell.inspection.planes import Plane
from aoicell.inspection.templates import Template
from aoicell.transforms import Array

_MOST = 20.0  # grey values: beyond that a pixel shows something else


@dataclass(frozen=True)
class SearchConfig:
    """`reach` (m) of the shifts, in steps of `step_px`, of templates up to `small` pixels half of
    that; turns in steps of `turn`, with shifts up to `turned_reach` (m). At most `pixels` of a
    template are asked; `best` places are kept.
    """

    reach: float = 5.5e-3
    step_px: float = 2.0
    turn: float = np.radians(7.5)
    turned_reach: float = 0.5e-3
    small: int = 150
    pixels: int = 100
    best: int = 6


class Search:
    """A template ready to be looked for; made once for a reference."""

    def __init__(self, template: Template, picture: Plane, config: SearchConfig) -> None:
        """`picture` is the reference's."""
        self._t, self._config = template, config
        own = template.uv[template.inside]  # what is about it stays where it is
        keep = np.linspace(0, len(own) - 1, min(config.pixels, len(own)))
        uv = own[keep.astype(int)]
        self._step_px = config.step_px if len(own) > config.small else config.step_px / 2
        self._arms = (uv - template.centre_px) @ np.linalg.inv(template.D).T
        self._values = picture[uv[:, 1].astype(int), uv[:, 0].astype(int)].astype(np.float32)

    def places(
        self, picture: Plane, around: float, most_turn: float = np.pi, least: float = 0.0
    ) -> list[Place]:
        """The best places in a picture, shifted `around` (m) at most, or turned; shifted
        `least` (m) at least.
        """
        config = self._config
        scale = self._t.px_per_m
        slid = _grid(around, self._step_px / scale)
        near = _grid(min(around, config.turned_reach), self._step_px / scale)
        count = int(min(most_turn, np.pi) / config.turn + 1e-9)
        turns = config.turn * np.array([n for n in range(-count, count + 1) if n])
        tries = np.concatenate(
            [np.column_stack([slid, np.zeros(len(slid))])]
            + [np.column_stack([near, np.full(len(near), turn)]) for turn in turns]
        )
        tries = tries[np.hypot(tries[:, 0], tries[:, 1]) >= least]
        found: list[Place] = []
        if not len(tries):
            return found
        for index in np.argsort(self._differences(picture, tries)):
            x, y, turn = tries[index]
            if all(self._apart(tries[index], other, scale) for other in found):
                found.append(Place((float(x), float(y)), float(turn)))
            if len(found) == config.best:
                break
        return found

    def _apart(self, a: Array, b: Place, scale: float) -> bool:
        """Whether two places are no neighbours of a grid."""
        apart_px = np.hypot(a[0] - b.shift[0], a[1] - b.shift[1]) * scale
        turn = abs((a[2] - b.rotation + np.pi) % (2 * np.pi) - np.pi)
        return bool(apart_px > 2.5 * self._config.step_px or turn > 1.5 * self._config.turn)

    def _differences(self, picture: Plane, tries: Array) -> NDArray[np.float64]:
        """Of the template and the picture at K places (K, 3), in the mean."""
        c, s = np.cos(tries[:, 2]), np.sin(tries[:, 2])
        x, y = self._arms.T
        X = c[:, None] * x - s[:, None] * y + tries[:, :1]
        Y = s[:, None] * x + c[:, None] * y + tries[:, 1:2]
        D, (u, v) = self._t.D, self._t.centre_px
        at = (D[0, 0] * X + D[0, 1] * Y + u, D[1, 0] * X + D[1, 1] * Y + v)
        columns, rows = (a.astype(np.float32) for a in at)
        seen = np.asarray(cv2.remap(picture, columns, rows, cv2.INTER_LINEAR))
        return np.asarray(np.minimum(np.abs(seen - self._values), _MOST).mean(axis=1), float)


def _grid(reach: float, step: float) -> Array:
    """Shifts (K, 2) up to `reach`, a multiple of `step` in x and y."""
    count = int(reach / step)
    line = np.arange(-count, count + 1) * step
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    return np.asarray(grid[np.hypot(*grid.T) <= reach + 1e-12])
