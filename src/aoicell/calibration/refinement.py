"""Hand-eye and arm refined together on the reprojection error of all views.

The camera on the flange, the board in the base, and the arm's joint offsets and joint origins
are moved until the detected corners are met best. The arm's terms are held near the nominal
model by priors: an arm is built to tolerances, and part of them cannot be told from the
hand-eye (joint 6) or from the base's own frame (joint 1).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from aoicell.calibration.hand_eye import HandEye, HandEyeConfig, checked
from aoicell.camera import Camera
from aoicell.robot import Arm
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.pose import motion_jacobian
from aoicell.transforms import SE3, Array, from_rvec


@dataclass(frozen=True)
class RefinementConfig:
    """Weights of the refinement.

    `sigma_px` stands for a whole view: the arm's repeatability moves all corners of a view
    together, so they count as one measurement and not as many. The priors are what is
    assumed of an arm that nobody calibrated.
    """

    sigma_px: float = 1.0
    joint_sigma_deg: float = 0.1
    origin_sigma_mm: float = 0.5


def refine_hand_eye(
    start: HandEye,
    arm: Arm,
    target: Chessboard,
    camera: Camera,
    uvs_px: Sequence[Array],
    qs: Sequence[Array],
    Ts_camera_target: Sequence[SE3],
    config: RefinementConfig = RefinementConfig(),
) -> tuple[HandEye, Arm]:
    """Hand-eye and corrected arm that fit the corners (N, 2) of each view best, in px."""
    dof = arm.dof
    prior = np.concatenate(
        [
            np.full(dof, np.radians(config.joint_sigma_deg)),
            np.full(3 * dof, config.origin_sigma_mm / 1e3),
        ]
    )

    def model(x: Array) -> tuple[SE3, SE3, Arm]:
        offsets, shifts = np.split(x[12:] * prior, [dof])
        return (
            start.T_flange_camera * from_rvec(x[0:3], x[3:6]),
            start.T_base_target * from_rvec(x[6:9], x[9:12]),
            arm.corrected(offsets, shifts.reshape(dof, 3)),
        )

    def residuals(x: Array) -> Array:
        X, Z, corrected = model(x)
        errors = [
            (uv - camera.project(target.corners, (corrected.fk(q) * X).actInv(Z))).ravel()
            for uv, q in zip(uvs_px, qs, strict=True)
        ]
        return np.concatenate([*errors, config.sigma_px * x[12:]])

    def jacobian(x: Array) -> Array:
        X, Z, corrected = model(x)
        rows = [
            motion_jacobian(target.corners, camera, (corrected.fk(q) * X).actInv(Z))
            @ _camera_motion(x, q, X, Z, corrected, prior)
            for q in qs
        ]
        priors = np.hstack([np.zeros((4 * dof, 12)), config.sigma_px * np.eye(4 * dof)])
        return np.vstack([*(-row for row in rows), priors])

    start_x = np.zeros(12 + 4 * dof)
    solution = least_squares(residuals, start_x, jacobian, method="lm", x_scale="jac")
    X, Z, corrected = model(solution.x)
    Ts_base_flange = [corrected.fk(q) for q in qs]
    return checked(X, Z, Ts_base_flange, Ts_camera_target, HandEyeConfig()), corrected


def _camera_motion(x: Array, q: Array, X: SE3, Z: SE3, arm: Arm, prior: Array) -> Array:
    """How each parameter moves the target in the camera (rotation, translation), (6, 12 + 4 dof).

    With T = X^-1 A^-1 Z: a motion of Z, in its own axes, moves T from the right; one of X or of
    the flange A moves it from the left, the other way.
    """
    T_camera_flange = X.inverse()
    T = (arm.fk(q) * X).actInv(Z)
    R, Rc = T.rotation, T_camera_flange.rotation
    from_X = _against(T) @ _increments(x[0:3])
    from_Z = np.block([[R, np.zeros((3, 3))], [np.zeros((3, 3)), R]]) @ _increments(x[6:9])
    # twist of the flange in its own axes (translation, rotation) -> motion in camera axes
    carry = np.block([[np.zeros((3, 3)), Rc], [Rc, pin.skew(T_camera_flange.translation) @ Rc]])
    twists = np.hstack([arm.jacobian(q), arm.origin_jacobian(q)]) * prior
    return np.hstack([from_X, from_Z, _against(T) @ carry @ twists])


def _against(T: SE3) -> Array:
    """Motion of a target at pose T when the camera itself moves by (rotation, translation)."""
    eye, zero = np.eye(3), np.zeros((3, 3))
    return np.block([[-eye, zero], [pin.skew(T.translation), -eye]])


def _increments(rvec: Array) -> Array:
    """From changes of (rotation vector, translation) to a motion in the moved frame's axes."""
    zero = np.zeros((3, 3))
    return np.block([[pin.Jexp3(rvec), zero], [zero, pin.exp3(rvec).T]])
