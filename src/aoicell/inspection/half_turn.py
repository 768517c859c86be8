"""Whether a part that fits in its place was put in the other way round.

Where a half turn shows in a few pixels only, as in a connector's latch, all others outvote them.
What a half turn would change is drawn from the design, and asked for alone: a matched filter tells
how much of that change is in the picture, 0 of a part as it should be, 1 of one that was turned.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from aoicell.inspection.matching import Match
from aoicell.inspection.templates import Template
from aoicell.inspection.virtual_picture import BEYOND, Drawing
from aoicell.transforms import Array

_LEAST = 1e-6  # of a change that nothing would tell
_BLIND = 1e-3  # of the match's own freedom, so that it can be inverted


@dataclass(frozen=True)
class HalfTurnConfig:
    """From which `share` of the drawn change on a part was turned, and by how many sigma of noise
    the change has to be there: light and make are not drawn exactly, nor is every pixel's noise
    its own.
    """

    share: float = 0.4
    sure: float = 5.0


class HalfTurn:
    """What a half turn changes about a template's component; made once for a reference."""

    def __init__(
        self, template: Template, jacobian: Array, drawing: Drawing, config: HalfTurnConfig
    ) -> None:
        """`jacobian` (n, 5): how the template's grey values change with the match's numbers."""
        v, u = template.uv.astype(int).T[::-1]
        designed, turned = (p[v, u].astype(float) for p in (drawing.designed, drawing.turned))
        gain = template.values @ designed / max(designed @ designed, 1.0)
        known = template.inside & (drawing.numbers[v, u] != BEYOND)  # about it, others are drawn
        self._change = np.where(known, gain * (turned - designed), 0.0)
        self._jacobian, self._config = jacobian, config

    def confidence(self, match: Match) -> float:
        """How probable it is, from the picture of a match in its place, that the part was turned:
        above one half, it was.
        """
        share, strength = self.share(match)
        limit = max(self._config.share * strength, self._config.sure)
        return float(ndtr(share * strength - limit))

    def share(self, match: Match) -> tuple[float, float]:
        """How much of the change there is, and one over the standard deviation of that by noise.

        Both of the part of it that no shift, turn, gain or offset would make.
        """
        weights, A = match.weights, self._jacobian
        if not self._change.any():
            return 0.0, 0.0
        weighted = A * weights[:, None]
        normal = weighted.T @ A
        normal += _BLIND * np.diag(np.diag(normal)) + _LEAST * np.eye(5)
        change = self._change - A @ np.linalg.solve(normal, weighted.T @ self._change)
        power = float(weights @ change**2)
        if power < _LEAST:
            return 0.0, 0.0
        return float(np.sqrt(weights) * change @ match.z) / power, float(np.sqrt(power))
