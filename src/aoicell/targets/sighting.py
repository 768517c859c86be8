"""What the detection of a calibration target yields, and what such a target has to offer."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from aoicell.errors import TargetNotFound
from aoicell.observation import Image
from aoicell.transforms import SE3, Array


@dataclass(frozen=True, eq=False)
class Sighting:
    """Points of a target found in one picture.

    `ids` (N,) count into the target's `points`, `uv_px` (N, 2) are raw pixels.
    """

    ids: NDArray[Any]
    uv_px: Array


def complete(uv_px: Array) -> Sighting:
    """A sighting of all points of a target (M, 2), in order."""
    return Sighting(np.arange(len(uv_px)), uv_px)


class CalibrationTarget(Protocol):
    """A flat print whose points are known in its own frame.

    Every target's frame has its origin at the middle of its points, x to the right and y up as
    one looks at the print, z out of the print.
    """

    @property
    def points(self) -> Array:
        """All points (M, 3) in the target's frame (m)."""

    @property
    def half_turns(self) -> bool:
        """Whether the print looks the same after a half turn, so that a sighting has two readings:
        point i and point M - 1 - i change places.
        """

    @property
    def T_target_opencv(self) -> SE3:
        """The frame in which OpenCV, and recordings made with it, give this target's points."""

    def sight(self, grey: Image, name: str = "target") -> Sighting:
        """The points that are in a grey picture (H, W).

        Raises TargetNotFound, with the reason, when there are too few to fix a pose.
        """


def opencv_frame(x: float, y: float) -> SE3:
    """T_target_opencv of a frame at (x, y) m of the print: x right, y down, z into the print."""
    return SE3(np.diag([1.0, -1.0, -1.0]), np.array([x, y, 0.0]))


def fixes_a_pose(points: Array) -> bool:
    """Whether points (N, 3) of a plane are spread both ways, not in one row."""
    spread = np.linalg.svd(points[:, :2] - points[:, :2].mean(axis=0), compute_uv=False)
    return bool(spread[1] > 1e-3 * spread[0])


def enough(sighting: Sighting, points: Array, needed: int, what: str, name: str) -> Sighting:
    """The sighting, if it fixes a pose. `what` says what was seen and what is needed."""
    if len(sighting.ids) < needed:
        raise TargetNotFound(f"{name}: {what}; bring more of the target into view, in focus")
    if not fixes_a_pose(points[sighting.ids]):
        raise TargetNotFound(
            f"{name}: all {len(sighting.ids)} points that were found lie in one row, which fixes "
            "no pose; bring more of the target into view"
        )
    return sighting
