"""Rigid transforms: `pinocchio.SE3` to and from what OpenCV, MuJoCo and TOML files speak.

`T_a_b` is the pose of b in a and maps b's coordinates to a's; neighbours cancel:
`T_base_board = T_base_flange * T_flange_camera * T_camera_board`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pinocchio import SE3, exp6
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

__all__ = [
    "SE3",
    "Array",
    "angle_of",
    "apply",
    "distance_deg",
    "distance_mm",
    "from_matrix",
    "from_rvec",
    "from_twist",
    "from_xyz_rpy",
    "is_rigid",
    "looking_at",
    "mean_pose",
    "rotation",
    "to_quat_wxyz",
    "to_rvec",
    "translation",
]


def from_matrix(T: ArrayLike) -> SE3:
    """SE3 from a homogeneous (4, 4) matrix."""
    M = np.asarray(T, dtype=float)
    return SE3(M[:3, :3].copy(), M[:3, 3].copy())


def from_rvec(rvec: ArrayLike, tvec: ArrayLike) -> SE3:
    """SE3 from OpenCV's rotation vector (rad) and translation (m)."""
    R = Rotation.from_rotvec(np.ravel(rvec)).as_matrix()
    return SE3(R, np.array(np.ravel(tvec), dtype=float))


def from_twist(twist: ArrayLike) -> SE3:
    """SE3 from a twist (6,): translation (m), rotation (rad); the exponential map."""
    return SE3(exp6(np.asarray(twist, dtype=float)))


def to_rvec(T: SE3) -> tuple[Array, Array]:
    """OpenCV's rotation vector (rad) and translation (m); safe at a half turn."""
    return Rotation.from_matrix(T.rotation).as_rotvec(), np.array(T.translation)


def from_xyz_rpy(xyz: ArrayLike, rpy: ArrayLike) -> SE3:
    """SE3 from a translation (m) and roll-pitch-yaw (rad), R = Rz Ry Rx as in URDF."""
    return SE3(Rotation.from_euler("xyz", rpy).as_matrix(), np.array(xyz, dtype=float))


def to_quat_wxyz(R: ArrayLike) -> Array:
    """Unit quaternion (w, x, y, z), MuJoCo's order, of a rotation matrix."""
    x, y, z, w = Rotation.from_matrix(np.asarray(R)).as_quat()
    return np.array([w, x, y, z])


def translation(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> SE3:
    """A pure translation (m)."""
    return SE3(np.eye(3), np.array([x, y, z]))


def rotation(axis: str, angle: float) -> SE3:
    """A pure rotation by `angle` (rad) about the axis 'x', 'y' or 'z'."""
    return SE3(Rotation.from_euler(axis, angle).as_matrix(), np.zeros(3))


def looking_at(
    aim: ArrayLike, distance: float, tilt: tuple[float, float] = (0.0, 0.0), roll: float = 0.0
) -> SE3:
    """T_target_camera of a camera that looks at the point `aim` (m) of a target from `distance`.

    Without tilt and roll it looks straight down on the print, its picture upright: x along the
    target's x, y against its y, z into it. `tilt` leans it about the target's x and y, `roll`
    turns it about the target's normal (rad).
    """
    lean = rotation("z", roll) * rotation("x", tilt[0]) * rotation("y", tilt[1])
    down = rotation("x", np.pi) * translation(z=-distance)
    return SE3(np.eye(3), np.array(aim, dtype=float)) * lean * down


def apply(T: SE3, points: ArrayLike) -> Array:
    """Map points (..., 3) from the child frame of T to its parent frame."""
    mapped: Array = np.asarray(points) @ T.rotation.T + T.translation
    return mapped


def angle_of(T: SE3) -> float:
    """Rotation angle of T (rad), in [0, pi]."""
    return float(np.linalg.norm(Rotation.from_matrix(T.rotation).as_rotvec()))


def distance_mm(T_1: SE3, T_2: SE3) -> float:
    """Distance between the origins of two poses (mm)."""
    return float(np.linalg.norm(T_1.translation - T_2.translation)) * 1e3


def distance_deg(T_1: SE3, T_2: SE3) -> float:
    """Angle of the rotation between two poses (deg)."""
    return float(np.degrees(angle_of(T_1.actInv(T_2))))


def mean_pose(poses: Sequence[SE3]) -> SE3:
    """Mean of several poses: mean translation, chordal mean rotation."""
    R = Rotation.from_matrix(np.array([T.rotation for T in poses])).mean().as_matrix()
    return SE3(R, np.mean([T.translation for T in poses], axis=0))


def is_rigid(T: SE3, tolerance: float = 1e-6) -> bool:
    """Whether T is finite, orthonormal and right-handed."""
    R = T.rotation
    return bool(
        np.isfinite(T.homogeneous).all()
        and np.abs(R @ R.T - np.eye(3)).max() < tolerance
        and np.linalg.det(R) > 0
    )
