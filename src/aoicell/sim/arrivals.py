"""How the as-built arm stops at a commanded posture."""

from collections.abc import Callable

import numpy as np

from aoicell.robot import Arm
from aoicell.sim.as_built import Arrival
from aoicell.transforms import Array

Torques = Callable[[Array], Array]  # gravity torque of each joint (N m) at joint angles (rad)


class Arrivals:
    """True joint angles of an arm after each arrival."""

    def __init__(self, arm: Arm, offsets: Array, arrival: Arrival, gravity: Torques) -> None:
        self._arm, self._offsets, self._arrival, self._gravity = arm, offsets, arrival, gravity
        self._rest = np.zeros(arm.dof)

    def arrive(self, q_command: Array, rng: np.random.Generator) -> None:
        """Come to rest at the commanded joint angles (rad), as exactly as the arm can."""
        # one sigma for all joints that gives the flange the stated spread per axis on average
        J = self._arm.jacobian(q_command)[:3]
        sigma = self._arrival.repeatability_sigma / float(np.sqrt((J**2).sum() / 3))
        self._rest = q_command + self._offsets + sigma * rng.standard_normal(self._arm.dof)

    def at_picture(self) -> Array:
        """True joint angles (rad) at the middle of the exposure."""
        return self._rest

    def rates_at_picture(self) -> Array:
        """True joint rates (rad/s) during the exposure."""
        return np.zeros(self._arm.dof)
