"""Watching reports everything, changes nothing, and waits when it is told to."""

import threading

import numpy as np
import pytest
from numpy.typing import ArrayLike

from aoicell.errors import Unreachable
from aoicell.observation import CameraName, Observation, RobotState
from aoicell.transforms import SE3, Array
from aoicell.view.watched import Gate, WatchedCell


class Recorder:
    def __init__(self) -> None:
        self.heard: list[object] = []

    def departs(self) -> None:
        self.heard.append("departs")

    def arrives(self, q_start: Array, q_end: Array) -> None:
        self.heard.append((q_start.tolist(), q_end.tolist()))

    def sees(self, observation: Observation) -> None:
        self.heard.append(observation)


class OneJointCell:
    def __init__(self) -> None:
        self.q = np.zeros(1)

    def move(self, q: ArrayLike) -> None:
        if np.asarray(q)[0] > 1:
            raise Unreachable("too far")
        self.q = np.array(q, dtype=float)

    def state(self) -> RobotState:
        return RobotState(self.q, SE3.Identity())

    def capture(self, camera: CameraName = "hand") -> Observation:
        return Observation(np.zeros((2, 2), np.uint8), self.state(), camera)


def test_moves_and_pictures_are_forwarded_and_reported() -> None:
    cell, recorder = OneJointCell(), Recorder()
    watched = WatchedCell(cell, recorder)
    watched.move([0.5])
    observation = watched.capture("tripod")
    assert cell.q == watched.state().q == [0.5]
    assert observation.camera == "tripod"
    assert recorder.heard == ["departs", ([0.0], [0.5]), observation]


def test_a_refused_move_stays_refused_and_no_arrival_is_reported() -> None:
    recorder = Recorder()
    with pytest.raises(Unreachable):
        WatchedCell(OneJointCell(), recorder).move([2.0])
    assert recorder.heard == ["departs"]


def test_an_open_gate_does_not_hold() -> None:
    Gate().halt()


class Walker:
    """Goes through a gate again and again, in a thread of its own."""

    def __init__(self, gate: Gate, halts: int) -> None:
        self.passed = threading.Semaphore(0)
        self.gate, self.halts = gate, halts
        self.thread = threading.Thread(target=self._walk, daemon=True)
        self.thread.start()

    def _walk(self) -> None:
        for _ in range(self.halts):
            self.gate.halt()
            self.passed.release()

    def passes(self) -> bool:
        return self.passed.acquire(timeout=5)

    def is_held(self) -> bool:
        return not self.passed.acquire(timeout=0.05)


def test_a_pause_holds_until_it_is_ended() -> None:
    gate = Gate()
    assert gate.toggle() is True
    walker = Walker(gate, 2)
    assert walker.is_held()
    assert gate.toggle() is False
    assert walker.passes()
    assert walker.passes()


def test_a_step_leads_to_the_next_halt_and_no_further() -> None:
    gate = Gate()
    gate.toggle()
    walker = Walker(gate, 3)
    for _ in range(2):
        gate.step()
        assert walker.passes()
        assert walker.is_held()
    gate.toggle()
    assert walker.passes()


def test_a_step_on_the_way_pauses_at_the_next_halt() -> None:
    gate = Gate()
    gate.step()
    walker = Walker(gate, 1)
    assert walker.is_held()
    gate.toggle()
    assert walker.passes()
