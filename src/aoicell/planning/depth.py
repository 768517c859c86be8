"""What a depth camera in the robot's hand gives, and the protocol through which it is asked."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aoicell.camera import Camera
from aoicell.observation import Image, RobotState
from aoicell.transforms import Array


@dataclass(frozen=True, eq=False)
class DepthImage:
    """Depth and colour of one instant, pixel by pixel the same, and the robot's state then.

    `depth` (H, W), float32, in m along the optical axis, NaN where nothing was measured; `colour`
    (H, W, 3) RGB. Both are rectified: `camera` is the pinhole that the device states of itself.
    """

    depth: NDArray[np.float32]
    colour: Image
    camera: Camera
    state: RobotState

    def points(self) -> Array:
        """Points (H, W, 3) in the camera's frame (m), NaN where nothing was measured."""
        v, u = np.mgrid[: self.camera.height, : self.camera.width]
        K, z = self.camera.K, self.depth.astype(float)
        return np.dstack([(u - K[0, 2]) / K[0, 0] * z, (v - K[1, 2]) / K[1, 1] * z, z])


class DepthCell(Protocol):
    """Moves the arm, tells where the controller believes it is, takes depth images."""

    def move(self, q: ArrayLike) -> None:
        """Drive to the joint angles q (rad); returns when the arm has arrived."""

    def state(self) -> RobotState:
        """The controller's belief."""

    def capture_depth(self) -> DepthImage:
        """Take a depth image."""
