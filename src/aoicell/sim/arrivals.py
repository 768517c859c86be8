"""How the as-built arm stops at a commanded posture."""

from collections.abc import Callable

import numpy as np

from aoicell.robot import Arm
from aoicell.sim.as_built import Arrival
from aoicell.transforms import Array

# Torque (N m) with which each joint holds the arm against gravity, at joint angles (rad).
Torques = Callable[[Array], Array]

LEVER = 0.1  # where a move mainly turns the flange, its settling is that of a point this far off


class Arrivals:
    """True joint angles of an arm after each arrival.

    `offsets` (dof,) are the errors of the joint zeros (rad). The draws of an arrival come from
    its own random stream; play and settling depend on the commands alone.
    """

    def __init__(self, arm: Arm, offsets: Array, arrival: Arrival, gravity: Torques) -> None:
        self._arm, self._offsets, self._arrival, self._gravity = arm, offsets, arrival, gravity
        self._command: Array | None = None
        self._rest = self._slack = self._left = np.zeros(arm.dof)

    def restart(self, q_command: Array) -> None:
        """Stand at rest at commanded joint angles (rad), with no history and nothing drawn."""
        self._slack = self._left = np.zeros(self._arm.dof)
        self._command = q_command.copy()
        self._rest = self.posture(q_command) + self._sag(q_command)

    def arrive(self, q_command: Array, rng: np.random.Generator) -> None:
        """Come to rest at the commanded joint angles (rad), as exactly as the arm can."""
        move = np.zeros(self._arm.dof) if self._command is None else q_command - self._command
        self._command = q_command.copy()
        self._slack = self._take_up(move)
        self._left = self._left_on_arrival(q_command, move)
        drawn = self.posture(q_command) + self._repeatability(q_command, rng)
        self._rest = drawn + self._slack + self._sag(q_command)

    def posture(self, q_command: Array) -> Array:
        """Joint angles (rad) at a command, or anywhere on the way, but for what arriving adds."""
        return q_command + self._offsets

    def at_picture(self) -> Array:
        """True joint angles (rad) at the middle of the exposure."""
        return self._rest - self._unsettled() * self._left

    def rates_at_picture(self) -> Array:
        """True joint rates (rad/s) during the exposure."""
        return self._unsettled() / (self._arrival.settle_time or 1.0) * self._left

    def _repeatability(self, q: Array, rng: np.random.Generator) -> Array:
        """One sigma for all joints that gives the flange the stated spread per axis on average.

        RP of ISO 9283 is 3.6 of it where the flange spreads alike along all axes; where the arm
        favours one axis it comes to 4.0.
        """
        J = self._arm.jacobian(q)[:3]
        sigma = self._arrival.repeatability_sigma / float(np.sqrt((J**2).sum() / 3))
        return sigma * rng.standard_normal(self._arm.dof)

    def _take_up(self, move: Array) -> Array:
        """Play: a joint follows its drive only once the slack is taken up, so that it stops half
        the play short, on the side that it comes from; one that does not move stays there.
        """
        half = self._arrival.backlash / 2
        return np.clip(self._slack - move, -half, half)

    def _sag(self, q: Array) -> Array:
        """What gravity turns the joints by: against the torque that holds them."""
        return -self._arrival.compliance * self._gravity(self.posture(q))

    def _left_on_arrival(self, q: Array, move: Array) -> Array:
        """What the joints have still to go on arrival: the last part of the move.

        The flange is `settle` from its rest, but no further than it came.
        """
        twist = self._arm.jacobian(q) @ move
        way = float(max(np.linalg.norm(twist[:3]), LEVER * np.linalg.norm(twist[3:])))
        settle = self._arrival.settle
        left: Array = settle / max(way, settle, 1e-12) * move
        return left

    def _unsettled(self) -> float:
        """Share of that which is left at the picture, `lag` before the pose that it comes with."""
        how = self._arrival
        if how.settle_time == 0:
            return 0.0
        return float(np.exp(-max(how.wait - how.lag, 0.0) / how.settle_time))
