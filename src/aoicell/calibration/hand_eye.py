"""Hand-eye calibration in closed form: A X = Z B over several robot poses.

A is the board in the flange's view of the world: with T_base_flange and T_camera_target
measured, T_base_flange * T_flange_camera * T_camera_target = T_base_target in each view,
X = T_flange_camera and Z = T_base_target unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, Protocol

import cv2
import numpy as np

from aoicell.errors import Implausible
from aoicell.transforms import (
    SE3,
    Array,
    angle_of,
    distance_deg,
    distance_mm,
    is_rigid,
    mean_pose,
)

Solver = Literal["shah", "li"]
_SOLVERS = MappingProxyType(
    {
        "shah": cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH,  # Shah 2013
        "li": cv2.CALIB_ROBOT_WORLD_HAND_EYE_LI,  # Li, Wang, Wu 2010
    }
)


@dataclass(frozen=True)
class HandEyeConfig:
    """Closed form to use, and what is demanded of the motion and of the result."""

    solver: Solver = "shah"
    min_views: int = 3
    min_rotation_deg: float = 10.0
    max_scatter_mm: float = 20.0


@dataclass(frozen=True)
class HandEye:
    """The camera on the flange and the board in the base.

    `scatter_mm` and `scatter_deg` (rms): how far the board, computed through each view,
    lies from its mean pose.
    """

    T_flange_camera: SE3
    T_base_target: SE3
    scatter_mm: float
    scatter_deg: float
    views: int


class HandEyeSolver(Protocol):
    """Solves A X = Z B."""

    def __call__(
        self, Ts_base_flange: Sequence[SE3], Ts_camera_target: Sequence[SE3], /
    ) -> HandEye:
        """X = T_flange_camera and Z = T_base_target. Raises Implausible."""


def solve_hand_eye(
    Ts_base_flange: Sequence[SE3],
    Ts_camera_target: Sequence[SE3],
    config: HandEyeConfig = HandEyeConfig(),
) -> HandEye:
    """Closed-form A X = Z B. Raises Implausible on too little motion or a nonsense result."""
    _check_motion(Ts_base_flange, config)
    Ts_flange_base = [T.inverse() for T in Ts_base_flange]
    R_target_base, t_target_base, R_camera_flange, t_camera_flange = cv2.calibrateRobotWorldHandEye(
        [T.rotation for T in Ts_camera_target],
        [T.translation for T in Ts_camera_target],
        [T.rotation for T in Ts_flange_base],
        [T.translation for T in Ts_flange_base],
        method=_SOLVERS[config.solver],
    )
    X = SE3(R_camera_flange, np.ravel(t_camera_flange)).inverse()
    Z = SE3(R_target_base, np.ravel(t_target_base)).inverse()
    return checked(X, Z, Ts_base_flange, Ts_camera_target, config)


def checked(
    X: SE3, Z: SE3, Ts_base_flange: Sequence[SE3], Ts_camera_target: Sequence[SE3],
    config: HandEyeConfig,
) -> HandEye:  # fmt: skip
    """The result with its scatter; solvers return nonsense with success, so look at it."""
    if not (is_rigid(X, 1e-4) and is_rigid(Z, 1e-4)):
        raise Implausible(
            f"hand-eye ({config.solver}): the solver returned no rigid transform over "
            f"{len(Ts_base_flange)} views; take views with more rotation about two axes"
        )
    Ts_base_target = [A * X * B for A, B in zip(Ts_base_flange, Ts_camera_target, strict=True)]
    mean = mean_pose(Ts_base_target)
    mm = _rms([distance_mm(T, mean) for T in Ts_base_target])
    if mm > config.max_scatter_mm:
        raise Implausible(
            f"hand-eye ({config.solver}): the board scatters {mm:.1f} mm over the views, at most "
            f"{config.max_scatter_mm:.0f} mm is accepted; check that pictures and poses belong "
            "together and the pose convention"
        )
    deg = _rms([distance_deg(T, mean) for T in Ts_base_target])
    return HandEye(X, Z, mm, deg, len(Ts_base_flange))


def _check_motion(Ts_base_flange: Sequence[SE3], config: HandEyeConfig) -> None:
    """Rotations about at least two axes; else part of X cannot be told."""
    if len(Ts_base_flange) < config.min_views:
        raise Implausible(
            f"hand-eye: {len(Ts_base_flange)} views are too few; take at least {config.min_views}"
        )
    first = Ts_base_flange[0]
    turns = np.array([_rotation_vector(first.actInv(T)) for T in Ts_base_flange[1:]])
    spread = np.degrees(np.linalg.svd(turns, compute_uv=False)) if len(turns) else np.zeros(1)
    if len(spread) < 2 or spread[1] < config.min_rotation_deg:
        second = float(spread[1]) if len(spread) > 1 else 0.0
        raise Implausible(
            f"hand-eye: the flange turns by {second:.1f} deg about a second axis, at least "
            f"{config.min_rotation_deg:.0f} deg are needed; tilt the camera both ways"
        )


def _rotation_vector(T: SE3) -> Array:
    angle = angle_of(T)
    if angle < 1e-9:
        return np.zeros(3)
    rvec, _ = cv2.Rodrigues(T.rotation)
    return np.ravel(rvec)


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
