"""Each pose format, against numbers worked out by hand, and what is no pose."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.datasets.manifest import PoseFormat
from aoicell.datasets.poses import COLUMNS, conventional, decode, encode, implausible_lengths
from aoicell.errors import InputError
from aoicell.transforms import SE3, Array, from_xyz_rpy, rotation, translation

FORMATS: tuple[PoseFormat, ...] = tuple(COLUMNS)

# A quarter turn about z: x goes to y.
QUARTER = translation(1, 2, 3) * rotation("z", np.pi / 2)
H = np.sqrt(0.5)
WRITTEN: dict[PoseFormat, list[float]] = {
    "matrix4x4_row_major": [0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1],
    "opencv_yaml": [0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1],
    "xyz_quat_xyzw": [1, 2, 3, 0, 0, H, H],
    "named_quat": [1, 2, 3, 0, 0, H, H],
    "xyz_quat_wxyz": [1, 2, 3, H, 0, 0, H],
    "xyz_rotvec": [1, 2, 3, 0, 0, np.pi / 2],
    "visp_vector": [1, 2, 3, 0, 0, np.pi / 2],
}

angles = st.floats(-np.pi, np.pi)
lengths = st.floats(-5000, 5000)
poses = st.builds(
    lambda x, y, z, r, p, w: from_xyz_rpy([x, y, z], [r, p, w]), *[lengths] * 3, *[angles] * 3
)


@pytest.mark.parametrize("pose_format", FORMATS)
def test_a_quarter_turn_by_hand(pose_format: PoseFormat) -> None:
    written = np.array(WRITTEN[pose_format], dtype=float)
    assert decode(written, pose_format, "it").isApprox(QUARTER, 1e-12)
    np.testing.assert_allclose(encode(QUARTER, pose_format), written, atol=1e-12)


@pytest.mark.parametrize("pose_format", FORMATS)
@given(T=poses)
def test_what_is_encoded_decodes(pose_format: PoseFormat, T: SE3) -> None:
    again = decode(encode(T, pose_format), pose_format, "it")
    assert np.abs(again.homogeneous - T.homogeneous).max() < 1e-12


@pytest.mark.parametrize("pose_format", FORMATS)
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_half_turn(pose_format: PoseFormat, axis: str) -> None:
    again = decode(encode(rotation(axis, np.pi), pose_format), pose_format, "it")
    assert again.isApprox(rotation(axis, np.pi), 1e-12)


def matrix(R: Array) -> list[float]:
    M = np.eye(4)
    M[:3, :3], M[:3, 3] = R, [0.1, 0.2, 0.3]
    return list(M.ravel())


TRANSPOSED = QUARTER.homogeneous.T.ravel().tolist()


@pytest.mark.parametrize(
    ("pose_format", "values", "reason"),
    [
        ("xyz_quat_xyzw", [1, 2, 3, 0, 0, 1], "6 numbers; a pose in format 'xyz_quat_xyzw' has 7"),
        ("xyz_quat_xyzw", [1, 2, np.nan, 0, 0, 0, 1], "nan is no finite number"),
        ("xyz_rotvec", [1, 2, 3, 0, np.inf, 0], "inf is no finite number"),
        ("xyz_quat_xyzw", [1, 2, 3, 0, 0, 0, 0.9], "norm is 0.9, not 1"),
        ("xyz_quat_wxyz", [1, 2, 3, 0, 0, 0, 0], "norm is 0, not 1"),
        ("xyz_rotvec", [1, 2, 3, 0, 90, 0], "more than a full turn; it has to be in radians"),
        ("matrix4x4_row_major", matrix(np.diag([1, 1, -1])), "left-handed"),
        ("matrix4x4_row_major", matrix(1.1 * np.eye(3)), "is no rotation"),
        ("opencv_yaml", matrix(np.array([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]])), "is no rotation"),
        ("matrix4x4_row_major", TRANSPOSED, "not 0 0 0 1; write it row by row"),
    ],
)
def test_what_is_no_pose(pose_format: PoseFormat, values: list[float], reason: str) -> None:
    with pytest.raises(InputError, match=r"^p.csv, line 3: ") as caught:
        decode(np.array(values, dtype=float), pose_format, "p.csv, line 3")
    assert reason in str(caught.value)


def test_three_decimals_are_enough(rng: np.random.Generator) -> None:
    for _ in range(50):
        T = from_xyz_rpy([0.5, 0.1, 0.2], rng.uniform(-3, 3, 3))
        for pose_format in FORMATS:
            again = decode(np.round(encode(T, pose_format), 3), pose_format, "it")
            assert again.isApprox(T, 3e-3)
            R = again.rotation
            np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)


def test_conventions_are_applied() -> None:
    T = translation(0.5, 0.1, 0.2) * rotation("x", 0.3)
    in_mm = SE3(T.rotation, T.translation * 1e3)
    assert conventional(T, "T_base_flange", "m").isApprox(T)
    assert conventional(in_mm, "T_base_flange", "mm").isApprox(T, 1e-12)
    assert conventional(T.inverse(), "T_flange_base", "m").isApprox(T, 1e-12)


def test_lengths_that_no_arm_has() -> None:
    Ts, wheres = [translation(x=0.5), translation(x=0.6)], ["line 1", "line 2"]
    assert implausible_lengths(Ts, wheres) is None
    far = implausible_lengths([SE3(T.rotation, T.translation * 1e3) for T in Ts], wheres)
    assert far == "the pose in line 2 would be 600 m from its origin"
    near = implausible_lengths([SE3(T.rotation, T.translation * 1e-3) for T in Ts], wheres)
    assert near is not None
    assert near.startswith("no pose would be further than 0.6 mm")
