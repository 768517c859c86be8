"""Joint trajectories from rest to rest, time-optimal within speed, acceleration and jerk limits.

All joints move in proportion, so the path is a straight line between the joint angles.
"""

from dataclasses import dataclass, fields

import numpy as np
import ruckig
from numpy.typing import ArrayLike

from aoicell.errors import InputError
from aoicell.robot.arm import Arm
from aoicell.transforms import Array


@dataclass(frozen=True)
class MotionLimits:
    """What the drives may do: a share of the rated speeds, and how fast they get there.

    Makers publish joint speeds, but neither acceleration nor jerk. Assumed, as usual in this
    class of arms: rated speed in 0.3 s at full acceleration, full acceleration in 0.1 s.
    """

    speed_share: float = 1.0
    time_to_speed: float = 0.3
    time_to_acceleration: float = 0.1

    def __post_init__(self) -> None:
        for field in fields(self):
            value, high = getattr(self, field.name), 1.0 if field.name == "speed_share" else 10.0
            if not 1e-3 <= value <= high:
                raise InputError(f"{field.name}: {value} is not from 0.001 to {high:g}")


@dataclass(frozen=True)
class Trajectory:
    """A planned move: joint angles (rad) over time (s)."""

    q_start: Array
    q_end: Array
    duration: float
    _profile: ruckig.Trajectory

    def sample(self, t: float) -> Array:
        """Joint angles (dof,) at time t; before the start and after the end those of the ends."""
        position, _, _ = self._profile.at_time(min(max(t, 0.0), self.duration))
        return np.array(position)

    def path(self, step: float) -> Array:
        """Points (N, dof) of the path, both ends included; no joint moves more than `step` (rad)
        from one to the next.
        """
        way = self.q_end - self.q_start
        count = int(np.ceil(np.abs(way).max() / step))
        return self.q_start + np.linspace(0, 1, count + 1)[:, None] * way


def plan(
    arm: Arm, q_start: ArrayLike, q_end: ArrayLike, limits: MotionLimits | None = None
) -> Trajectory:
    """The fastest move from rest to rest along the straight line from q_start to q_end (rad).

    Knows nothing of obstacles or joint limits. Raises InputError when no plan is possible.
    """
    limits = limits or MotionLimits()
    start, end = (np.array(q, dtype=float) for q in (q_start, q_end))
    speed, acceleration = arm.velocity_limits, arm.velocity_limits / limits.time_to_speed
    request = ruckig.InputParameter(arm.dof)
    request.current_position, request.target_position = start, end
    request.max_velocity = limits.speed_share * speed
    request.max_acceleration = acceleration
    request.max_jerk = acceleration / limits.time_to_acceleration
    request.synchronization = ruckig.Synchronization.Phase  # all joints in proportion
    profile = ruckig.Trajectory(arm.dof)
    try:
        result = ruckig.Ruckig(arm.dof).calculate(request, profile)
    except (ruckig.RuckigError, RuntimeError) as error:
        raise InputError(f"no trajectory from {start} to {end} rad: {error}") from None
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise InputError(f"no trajectory from {start} to {end} rad: {result.name}")
    return Trajectory(start, end, float(profile.duration), profile)
