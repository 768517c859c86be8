"""Hand-eye and arm refined together on the reprojection error of all views.

The camera on the flange, the board in the base, and the arm's joint offsets and joint origins
are moved until the detected corners are met best. The arm's terms are held near the nominal
model by priors: an arm is built to tolerances, and part of them cannot be told from the
hand-eye (joint 6) or from the base's own frame (joint 1).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from aoicell.calibration.hand_eye import HandEye, HandEyeConfig, checked
from aoicell.camera import Camera
from aoicell.robot import Arm
from aoicell.targets.chessboard import Chessboard
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

    solution = least_squares(residuals, np.zeros(12 + 4 * dof), x_scale="jac")
    X, Z, corrected = model(solution.x)
    Ts_base_flange = [corrected.fk(q) for q in qs]
    return checked(X, Z, Ts_base_flange, Ts_camera_target, HandEyeConfig()), corrected
