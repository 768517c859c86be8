"""Poses in the formats that robots and vision libraries write: from numbers and to numbers.

Lengths stay in the file's unit here; `conventional` brings poses to metres and T_base_flange.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.spatial.transform import Rotation

from aoicell.datasets.manifest import LengthUnit, PoseFormat, PoseMeaning
from aoicell.errors import InputError
from aoicell.transforms import SE3, Array, to_quat_wxyz, to_rvec

METRES = MappingProxyType({"m": 1.0, "mm": 1e-3})
NEAREST, FURTHEST = 0.02, 20.0  # m: an arm's flange lies between these from its base
ID = "id"  # the column of a table that names the view
_ORTHOGONAL = 5e-3  # what printing a rotation with three decimals leaves
_UNIT_NORM = 1e-2


@dataclass(frozen=True)
class FilePose:
    """A pose as a file has it: `id` from its name or column, `where` it stands, its own unit."""

    id: str
    where: str
    T: SE3


# -- From numbers ------------------------------------------------------------------------


def decode(values: Array, pose_format: PoseFormat, where: str) -> SE3:
    """The pose of a format's numbers, in the unit of the file.

    Raises InputError, which names `where`, for anything that is no rigid transform.
    """
    wanted = len(COLUMNS[pose_format])
    if len(values) != wanted:
        names = " ".join(COLUMNS[pose_format])
        raise InputError(
            f"{where}: {len(values)} numbers; a pose in format '{pose_format}' has {wanted}: "
            f"{names}"
        )
    if not np.isfinite(values).all():
        raise InputError(f"{where}: {values[~np.isfinite(values)][0]} is no finite number")
    return _DECODERS[pose_format](values, where)


def _from_matrix(values: Array, where: str) -> SE3:
    M = values.reshape(4, 4)
    if np.abs(M[3] - [0, 0, 0, 1]).max() > 1e-6:
        hint = "write it row by row" if np.abs(M[:3, 3]).max() == 0 else "no rigid transform"
        raise InputError(f"{where}: the last row is {M[3].tolist()}, not 0 0 0 1; {hint}")
    R = M[:3, :3]
    gap = float(np.abs(R @ R.T - np.eye(3)).max())
    if gap > _ORTHOGONAL:
        raise InputError(
            f"{where}: the upper left 3x3 block is no rotation (R R^T differs from the unit "
            f"matrix by {gap:.2g}); scaled or sheared matrices cannot be used"
        )
    if np.linalg.det(R) < 0:
        raise InputError(
            f"{where}: the rotation is left-handed (determinant -1); one axis is mirrored"
        )
    return SE3(Rotation.from_matrix(R).as_matrix(), M[:3, 3].copy())


def _from_quaternion(values: Array, where: str) -> SE3:
    """Translation, then the quaternion as x y z w."""
    norm = float(np.linalg.norm(values[3:]))
    if abs(norm - 1) > _UNIT_NORM:
        raise InputError(
            f"{where}: the quaternion's norm is {norm:.4g}, not 1; check the columns and the format"
        )
    return SE3(Rotation.from_quat(values[3:]).as_matrix(), values[:3].copy())


def _from_quaternion_wxyz(values: Array, where: str) -> SE3:
    return _from_quaternion(values[[0, 1, 2, 4, 5, 6, 3]], where)


def _from_rotation_vector(values: Array, where: str) -> SE3:
    angle = float(np.linalg.norm(values[3:]))
    if angle > 2 * np.pi + 1e-3:
        raise InputError(
            f"{where}: the rotation vector has length {angle:.4g}, more than a full turn; "
            "it has to be in radians"
        )
    return SE3(Rotation.from_rotvec(values[3:]).as_matrix(), values[:3].copy())


_DECODERS: Mapping[PoseFormat, Callable[[Array, str], SE3]] = MappingProxyType(
    {
        "matrix4x4_row_major": _from_matrix,
        "opencv_yaml": _from_matrix,
        "xyz_quat_xyzw": _from_quaternion,
        "named_quat": _from_quaternion,
        "xyz_quat_wxyz": _from_quaternion_wxyz,
        "xyz_rotvec": _from_rotation_vector,
        "visp_vector": _from_rotation_vector,  # theta u is the rotation vector
    }
)
_MATRIX = tuple(f"m{row}{column}" for row in range(4) for column in range(4))
COLUMNS: Mapping[PoseFormat, tuple[str, ...]] = MappingProxyType(
    {
        "matrix4x4_row_major": _MATRIX,
        "opencv_yaml": _MATRIX,
        "xyz_quat_xyzw": ("x", "y", "z", "qx", "qy", "qz", "qw"),
        "xyz_quat_wxyz": ("x", "y", "z", "qw", "qx", "qy", "qz"),
        "named_quat": ("x", "y", "z", "qx", "qy", "qz", "qw"),
        "xyz_rotvec": ("x", "y", "z", "rx", "ry", "rz"),
        "visp_vector": ("tx", "ty", "tz", "thetaux", "thetauy", "thetauz"),
    }
)


# -- To numbers --------------------------------------------------------------------------


def encode(T: SE3, pose_format: PoseFormat) -> Array:
    """The numbers of a pose, in the order of COLUMNS."""
    if pose_format in ("matrix4x4_row_major", "opencv_yaml"):
        return np.array(T.homogeneous, dtype=float).ravel()
    if pose_format in ("xyz_rotvec", "visp_vector"):
        return np.concatenate([T.translation, to_rvec(T)[0]])
    w, x, y, z = to_quat_wxyz(T.rotation)
    quaternion = [w, x, y, z] if pose_format == "xyz_quat_wxyz" else [x, y, z, w]
    return np.concatenate([T.translation, quaternion])


# -- Conventions -------------------------------------------------------------------------


def in_metres(T: SE3, unit: LengthUnit) -> SE3:
    """A pose whose translation is in `unit`, in metres."""
    return SE3(T.rotation, T.translation * METRES[unit])


def conventional(T: SE3, meaning: PoseMeaning, unit: LengthUnit) -> SE3:
    """T_base_flange in metres of a file's pose."""
    T_metres = in_metres(T, unit)
    return T_metres if meaning == "T_base_flange" else T_metres.inverse()


def implausible_lengths(Ts: Sequence[SE3], wheres: Sequence[str]) -> str | None:
    """What is odd about the distances of poses (m) from their origin; None when nothing is."""
    lengths = [float(np.linalg.norm(T.translation)) for T in Ts]
    longest = int(np.argmax(lengths))
    if lengths[longest] > FURTHEST:
        return f"the pose in {wheres[longest]} would be {lengths[longest]:.4g} m from its origin"
    if lengths[longest] < NEAREST:
        return (
            f"no pose would be further than {lengths[longest] * 1e3:.3g} mm from its origin, "
            f"not even that in {wheres[longest]}"
        )
    return None
