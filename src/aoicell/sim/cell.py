"""`SimCell`: the simulated world as the estimating code may see it, and nothing else."""

import numpy as np
from numpy.typing import ArrayLike

from aoicell.errors import InputError, Unreachable
from aoicell.observation import CameraName, Observation, RobotState
from aoicell.sim.world import World


class SimCell:
    """The `Cell` protocol over a `World`: nominal kinematics, commanded joints, pictures."""

    __slots__ = ("_colour", "_world")

    def __init__(self, world: World, colour: bool = False) -> None:
        self._world, self._colour = world, colour

    def move(self, q: ArrayLike) -> None:
        """Drive to q (rad) along a straight joint path, and wait until a picture may be taken.

        Raises InputError on a wrong length, and Unreachable outside the limits or when bodies
        would touch on the way; the arm then stays where it is. The move takes its time on the
        world's clock; the dynamics between arrivals are skipped.
        """
        arm = self._world.nominal.arm
        target = np.asarray(q, dtype=float)
        if target.shape != (arm.dof,):
            raise InputError(f"move: got {target.size} joint angles; the arm has {arm.dof} joints")
        for name, angle, low, high in zip(
            arm.joint_names, target, arm.lower, arm.upper, strict=True
        ):
            if not low <= angle <= high:
                raise Unreachable(
                    f"{name}: commanded {np.degrees(angle):.1f} deg, its limits are "
                    f"{np.degrees(low):.0f} to {np.degrees(high):.0f} deg"
                )
        self._world.drive(target)

    def state(self) -> RobotState:
        """Commanded joints and the flange pose of the nominal kinematics."""
        q = self._world.q_command
        return RobotState(q, self._world.nominal.arm.fk(q))

    def capture(self, camera: CameraName = "hand") -> Observation:
        """Take a picture: grey (H, W), or RGB (H, W, 3) when the cell was made with colour."""
        image = self._world.picture(camera, self._colour)
        return self._world.observe(Observation(image, self.state(), camera))
