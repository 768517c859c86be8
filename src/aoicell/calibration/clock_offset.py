"""How far the clock of a camera is ahead of the robot's, from two streams of poses.

The angle that the camera turned between two pictures does not depend on how it is mounted: it
is the flange's between the same instants. The offset is where these angles agree best.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation, Slerp

from aoicell.errors import Implausible
from aoicell.transforms import SE3, Array

_SPANS = (0.1, 0.3, 0.9)  # s between the pictures of a pair: short ones are sharp, long ones sure
_STEP = 0.01  # s, of the first search
_MIN_PAIRS = 10


@dataclass(frozen=True)
class ClockOffset:
    """A picture stamped t was taken at t - `offset` of the robot's clock; s, with its deviation."""

    offset: float
    std: float


def estimate_clock_offset(
    t_robot: Array, Ts_base_flange: Sequence[SE3], t_camera: Array,
    Ts_camera_target: Sequence[SE3], most: float = 0.5,
) -> ClockOffset:  # fmt: skip
    """The offset (s) within +/- `most` from times (s), rising, and poses of both streams.

    Raises Implausible where the streams do not overlap or do not turn unevenly enough to tell.
    """
    flange = Slerp(t_robot, Rotation.from_matrix([T.rotation for T in Ts_base_flange]))
    camera = Rotation.from_matrix([T.rotation for T in Ts_camera_target])
    first, second = _pairs(t_camera)
    turned = (camera[first] * camera[second].inv()).magnitude()

    def residuals(offset: float) -> Array:
        a, b = t_camera[first] - offset, t_camera[second] - offset
        seen = (a >= t_robot[0]) & (b <= t_robot[-1])
        if seen.sum() < _MIN_PAIRS:
            return np.zeros(0)
        angles = (flange(a[seen]).inv() * flange(b[seen])).magnitude()
        return np.asarray(turned[seen] - angles)

    def cost(offset: float) -> float:
        r = np.abs(residuals(offset))
        if not len(r):
            return np.inf
        limit = 3 * max(float(np.median(r)), 1e-9)  # wrong poses do not decide
        return float(np.mean(np.minimum(r, limit) ** 2))

    grid = np.arange(-most, most + _STEP / 2, _STEP)
    costs = np.array([cost(offset) for offset in grid])
    if not np.isfinite(costs).any():
        raise Implausible(
            f"clock offset: the streams share fewer than {_MIN_PAIRS} pairs of pictures; record "
            "both over the same time"
        )
    near = float(grid[int(np.nanargmin(costs))])
    found = minimize_scalar(
        cost, bounds=(near - _STEP, near + _STEP), method="bounded", options={"xatol": 1e-6}
    )
    offset, h = float(found.x), 2e-3
    ahead, behind, r = residuals(offset + h), residuals(offset - h), residuals(offset)
    count = min(len(ahead), len(behind))
    slope = (ahead[:count] - behind[:count]) / (2 * h)
    told = float((slope**2).sum())
    noise = 1.4826 * float(np.median(np.abs(r))) if len(r) else np.inf
    shared = 2 * len(_SPANS)  # pairs that a picture is in: they are not as many measurements
    std = noise * np.sqrt(shared / told) if told > 0 else np.inf
    if not std < most / 10:
        raise Implausible(
            "clock offset: the flange turns too little or too evenly to tell it; turn it to and fro"
        )
    return ClockOffset(offset, float(std))


def _pairs(t: Array) -> tuple[Array, Array]:
    """Indices of pictures about each span apart."""
    first, second = [], []
    for span in _SPANS:
        j = np.searchsorted(t, t + span)
        i = np.flatnonzero(j < len(t))
        first.append(i)
        second.append(j[i])
    return np.concatenate(first), np.concatenate(second)
