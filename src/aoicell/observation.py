"""What the estimating code can ask of a cell, and what it gets.

A simulated cell, a recorded data set and a real robot all implement `Cell`.
Nothing here knows the truth.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from aoicell.transforms import SE3, Array

Image = NDArray[np.uint8]
CameraName = Literal["hand", "tripod"]


def to_grey(rgb: Image) -> Image:
    """Grey values (H, W) of an RGB picture (H, W, 3)."""
    return np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


@dataclass(frozen=True)
class RobotState:
    """What the controller believes: joint angles (rad) and its nominal kinematics' pose."""

    q: Array
    T_base_flange: SE3


@dataclass(frozen=True, eq=False)  # compared by identity: the truth behind it hangs on that
class Observation:
    """A picture, (H, W) grey or (H, W, 3) RGB, and the robot's state at the same instant."""

    image: Image
    state: RobotState
    camera: CameraName = "hand"

    @cached_property
    def grey(self) -> Image:
        """The picture as (H, W) grey values."""
        return self.image if self.image.ndim == 2 else to_grey(self.image)


class Cell(Protocol):
    """Moves the arm, tells where the controller believes it is, takes pictures."""

    def move(self, q: ArrayLike) -> None:
        """Drive to the joint angles q (rad); returns when the arm has arrived."""

    def state(self) -> RobotState:
        """The controller's belief."""

    def capture(self, camera: CameraName = "hand") -> Observation:
        """Take a picture."""


class Renderer(Protocol):
    """Draws the nominal world: what a camera would see if everything were as designed."""

    def render(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        """Picture of the nominal cell from a camera pose, with the board at a given pose."""


class SolidRenderer(Renderer, Protocol):
    """One that knows the board's components one by one."""

    def bare(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        """The same picture of the board without its components."""

    def half_turned(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        """The same picture with each component turned by half about its own middle."""

    def solids(
        self, T_base_camera: SE3, T_base_board: SE3
    ) -> tuple[NDArray[np.int16], NDArray[np.float32]]:
        """For each pixel (H, W) of the picture the number of the component that it shows, -1 for
        anything else, and how far in front of the camera that is (m, along its axis).
        """


def capture_at(cell: Cell, qs: Sequence[Array], camera: CameraName = "hand") -> list[Observation]:
    """Visit the joint targets one after the other and take a picture at each."""
    observations = []
    for q in qs:
        cell.move(q)
        observations.append(cell.capture(camera))
    return observations
