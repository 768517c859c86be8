"""Kinematics of a serial arm, read from its URDF with Pinocchio."""

from copy import copy
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from aoicell.errors import ModelError, Unreachable
from aoicell.transforms import SE3, Array, distance_deg, distance_mm


class Arm:
    """A serial arm: forward kinematics, Jacobian, inverse kinematics, limits.

    The URDF's root link is the frame `base`; its last frame is called `flange`.
    Raises ModelError when the file, a mesh or the flange frame is missing.
    """

    def __init__(self, urdf: Path) -> None:
        if not urdf.is_file():
            raise ModelError(f"{urdf}: no such file; the arm's folder must hold this URDF")
        try:
            self._model = pin.buildModelFromUrdf(str(urdf))
        except (ValueError, RuntimeError) as error:
            reason = str(error).splitlines()[0]
            raise ModelError(f"{urdf}: not a readable URDF ({reason})") from None
        if not self._model.existFrame("flange"):
            raise ModelError(f"{urdf}: no link is called 'flange'; the tool side needs one")
        self.urdf = urdf
        self._data = self._model.createData()
        self._flange = self._model.getFrameId("flange")
        self.lower = np.array(self._model.lowerPositionLimit)
        self.upper = np.array(self._model.upperPositionLimit)
        self.joint_names = tuple(self._model.names)[1:]
        self._offsets = np.zeros(self.dof)
        self._sides = [self._across(joint) for joint in range(1, self.dof + 1)]

    def corrected(self, joint_offsets: ArrayLike, joint_origins: ArrayLike) -> "Arm":
        """A copy with a better model: offsets (dof,) added to the commanded angles (rad).

        `joint_origins` (dof, 5): how each joint's origin stands off its design: a shift (m) along
        its parent's axes and a tilt (rad) of its axis, about the two directions of `_across`.
        """
        arm = copy(self)
        arm._model = self._model.copy()
        arm._sides = []
        for joint, error in enumerate(np.asarray(joint_origins, dtype=float), start=1):
            origin, sides = self._model.jointPlacements[joint], self._sides[joint - 1]
            tilt = sides @ error[3:]
            arm._model.jointPlacements[joint] = SE3(
                pin.exp3(tilt) @ origin.rotation, origin.translation + error[:3]
            )
            arm._sides.append(pin.Jexp3(-tilt) @ sides)  # about what a further tilt turns
        arm._data = arm._model.createData()
        arm._offsets = self._offsets + np.asarray(joint_offsets, dtype=float)
        return arm

    @property
    def dof(self) -> int:
        """Number of joints."""
        return int(self._model.nq)

    @property
    def velocity_limits(self) -> Array:
        """Rated speed of each joint (rad/s)."""
        return np.array(self._model.velocityLimit)

    def fk(self, q: ArrayLike) -> SE3:
        """T_base_flange at joint angles q (rad)."""
        pin.framesForwardKinematics(self._model, self._data, np.asarray(q) + self._offsets)
        return SE3(self._data.oMf[self._flange])

    def jacobian(self, q: ArrayLike) -> Array:
        """Flange twist in flange axes (m, rad) per joint rate, (6, dof)."""
        return np.array(
            pin.computeFrameJacobian(
                self._model, self._data, np.asarray(q) + self._offsets, self._flange, pin.LOCAL
            )
        )

    def origin_jacobian(self, q: ArrayLike) -> Array:
        """Flange twist in flange axes (m, rad) per error of each joint's origin, (6, 5 dof).

        The errors are those of `corrected`: shifts (m), then tilts (rad).
        """
        T_flange_base = self.fk(q).inverse()
        J = np.zeros((6, 5 * self.dof))
        for joint in range(1, self.dof + 1):
            parent = self._data.oMi[self._model.parents[joint]]
            R = T_flange_base.rotation @ parent.rotation
            origin = parent.act(self._model.jointPlacements[joint].translation)
            tilts = R @ self._sides[joint - 1]
            lever = -T_flange_base.act(origin)  # from the joint to the flange, in flange axes
            J[:3, 5 * joint - 5 : 5 * joint - 2] = R
            J[:3, 5 * joint - 2 : 5 * joint] = -pin.skew(lever) @ tilts
            J[3:, 5 * joint - 2 : 5 * joint] = tilts
        return J

    def _across(self, joint: int) -> Array:
        """Two directions (3, 2), in the parent's axes, at right angles to a joint's design axis."""
        pin.computeJointJacobians(self._model, self._data, np.zeros(self.dof))
        in_base = pin.getJointJacobian(self._model, self._data, joint, pin.WORLD)[3:, joint - 1]
        parent = self._data.oMi[self._model.parents[joint]]
        axis = parent.rotation.T @ in_base
        side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        side /= np.linalg.norm(side)
        return np.column_stack([side, np.cross(axis, side)])

    def limit_margin(self, q: ArrayLike) -> float:
        """Smallest angle (rad) to a joint limit; negative outside."""
        q = np.asarray(q, dtype=float)
        return float(np.minimum(q - self.lower, self.upper - q).min())

    def singularity_margin(self, q: ArrayLike) -> float:
        """Smallest singular value of the Jacobian (m and rad mixed)."""
        return float(np.linalg.svd(self.jacobian(q), compute_uv=False).min())

    def ik(self, T_base_flange: SE3, q_near: ArrayLike, name: str = "pose") -> Array:
        """Joint angles (rad) that reach a flange pose, on the branch of `q_near`.

        Levenberg-Marquardt on the twist in flange axes. Raises Unreachable, naming
        the pose and what is left, when no solution within the limits is found.
        """
        q: Array = np.clip(np.asarray(q_near, dtype=float), self.lower, self.upper)
        damping, error = 1e-4, self._error(q, T_base_flange)
        for _ in range(200):
            if np.abs(error).max() < 1e-12:
                break
            J = self.jacobian(q)
            step = np.linalg.solve(J.T @ J + damping * np.eye(self.dof), J.T @ error)
            trial = np.clip(q + step, self.lower, self.upper)
            trial_error = self._error(trial, T_base_flange)
            if np.linalg.norm(trial_error) < np.linalg.norm(error):
                q, error, damping = trial, trial_error, max(damping / 10, 1e-14)
            else:
                damping *= 10
                if damping > 1e6:
                    break
        if not np.abs(error).max() <= 1e-8:  # also when it is NaN
            raise Unreachable(self._explain(q, T_base_flange, name), q)
        return q

    def _error(self, q: Array, T_target: SE3) -> Array:
        twist: Array = np.array(pin.log6(self.fk(q).actInv(T_target)).vector)
        return twist

    def _explain(self, q: Array, T_target: SE3, name: str) -> str:
        reached = self.fk(q)
        at_limit = [
            f"{joint} at {np.degrees(angle):.0f} deg"
            for joint, angle, low, high in zip(
                self.joint_names, q, self.lower, self.upper, strict=True
            )
            if min(angle - low, high - angle) < 1e-6
        ]
        x, y, z = T_target.translation * 1e3
        return (
            f"{name}: flange pose at ({x:.0f}, {y:.0f}, {z:.0f}) mm in base is out of reach: the "
            f"nearest found is {distance_mm(reached, T_target):.0f} mm and "
            f"{distance_deg(reached, T_target):.1f} deg away"
            + (f" with {', '.join(at_limit)}" if at_limit else "")
            + "; move it closer to the arm or choose another orientation"
        )
