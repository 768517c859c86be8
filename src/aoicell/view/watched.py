"""A `Cell` that reports what happens in it, and halts when asked to."""

import threading
from typing import Protocol

from numpy.typing import ArrayLike

from aoicell.observation import CameraName, Cell, Observation, RobotState
from aoicell.transforms import Array


class Watcher(Protocol):
    """Is told before and after each move, and of each picture."""

    def departs(self) -> None:
        """The arm is about to move."""

    def arrives(self, q_start: Array, q_end: Array) -> None:
        """The arm has moved between these commanded joint angles (rad)."""

    def sees(self, observation: Observation) -> None:
        """A picture was taken."""


class WatchedCell:
    """Forwards everything to a cell and reports it; changes nothing."""

    def __init__(self, cell: Cell, watcher: Watcher) -> None:
        self._cell, self._watcher = cell, watcher

    def move(self, q: ArrayLike) -> None:
        """Drive to q (rad) as the cell does."""
        start = self._cell.state().q
        self._watcher.departs()
        self._cell.move(q)
        self._watcher.arrives(start, self._cell.state().q)

    def state(self) -> RobotState:
        """What the controller believes."""
        return self._cell.state()

    def capture(self, camera: CameraName = "hand") -> Observation:
        """Take a picture."""
        observation = self._cell.capture(camera)
        self._watcher.sees(observation)
        return observation


class Gate:
    """Where the trial waits while it is paused. Buttons act upon it from another thread."""

    def __init__(self) -> None:
        self._open = threading.Condition()
        self._paused, self._steps = False, 0

    def toggle(self) -> bool:
        """Pause, or go on; whether it is paused now."""
        with self._open:
            self._paused, self._steps = not self._paused, 0
            self._open.notify_all()
            return self._paused

    def step(self) -> None:
        """Go on to the next halt, and pause there."""
        with self._open:
            self._steps += self._paused
            self._paused = True
            self._open.notify_all()

    def halt(self) -> None:
        """Return at once, or when the pause ends; uses up a step."""
        with self._open:
            while self._paused and not self._steps:
                self._open.wait()
            self._steps = max(self._steps - 1, 0)
