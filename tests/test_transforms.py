"""Conversions keep the pose, also at an exact half turn; frames point where they say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell import transforms as tf
from aoicell.transforms import SE3, Array

finite = st.floats(-2.0, 2.0, allow_subnormal=False)
vectors = st.tuples(finite, finite, finite)
AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "xy": [1, 1, 0], "xyz": [1, -2, 3]}


def close(T_1: SE3, T_2: SE3, tolerance: float = 1e-9) -> bool:
    return bool(np.abs(T_1.homogeneous - T_2.homogeneous).max() < tolerance)


@given(vectors, vectors)
def test_rotation_vector_round_trip(rvec: tuple[float, ...], tvec: tuple[float, ...]) -> None:
    T = tf.from_rvec(rvec, tvec)
    assert tf.is_rigid(T)
    assert close(tf.from_rvec(*tf.to_rvec(T)), T)


@pytest.mark.parametrize("axis", AXES.values(), ids=AXES.keys())
@pytest.mark.parametrize("off", [0.0, 1e-12, 1e-9, -1e-7])
def test_half_turns_survive_the_round_trip(axis: list[float], off: float) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    T = tf.from_rvec((np.pi + off) * unit, [1, 2, 3])
    assert close(tf.from_rvec(*tf.to_rvec(T)), T, 1e-12)
    assert tf.angle_of(T) == pytest.approx(np.pi, abs=2e-7)


def test_an_exact_half_turn_in_whole_numbers() -> None:
    down = SE3(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
    rvec, _ = tf.to_rvec(down)
    np.testing.assert_allclose(np.abs(rvec), [np.pi, 0, 0], atol=1e-12)
    np.testing.assert_allclose(np.abs(tf.to_quat_wxyz(down.rotation)), [0, 1, 0, 0], atol=1e-12)


def test_rotation_vector_is_right_handed() -> None:
    quarter = tf.from_rvec([0, 0, np.pi / 2], [0, 0, 0])
    np.testing.assert_allclose(quarter.act(np.array([1.0, 0, 0])), [0, 1, 0], atol=1e-15)


def test_matrix_round_trip_copies() -> None:
    M = tf.from_rvec([0.1, 0.2, 0.3], [1, 2, 3]).homogeneous
    T = tf.from_matrix(M)
    M[:] = 0
    assert tf.is_rigid(T)
    np.testing.assert_array_equal(T.translation, [1, 2, 3])


def test_roll_pitch_yaw_is_the_urdf_order() -> None:
    r, p, y = 0.3, -0.5, 1.1
    expected = tf.rotation("z", y) * tf.rotation("y", p) * tf.rotation("x", r)
    assert close(tf.from_xyz_rpy([0, 0, 0], [r, p, y]), expected, 1e-12)


def test_quaternion_has_w_first() -> None:
    half = np.sqrt(0.5)
    R = tf.rotation("z", np.pi / 2).rotation
    np.testing.assert_allclose(tf.to_quat_wxyz(R), [half, 0, 0, half], atol=1e-12)


def test_apply_goes_from_child_to_parent_for_any_shape() -> None:
    T = tf.translation(1, 0, 0) * tf.rotation("z", np.pi / 2)
    np.testing.assert_allclose(tf.apply(T, [1, 0, 0]), [1, 1, 0], atol=1e-15)
    points = np.arange(24.0).reshape(2, 4, 3)
    np.testing.assert_allclose(tf.apply(T, points)[1, 2], T.act(points[1, 2]), atol=1e-12)


tilts = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))


@given(vectors, st.floats(0.2, 2.0), tilts, st.floats(-3, 3))
def test_looking_at_puts_the_aim_on_the_optical_axis(
    aim: tuple[float, ...], distance: float, tilt: tuple[float, float], roll: float
) -> None:
    T_target_camera = tf.looking_at(aim, distance, tilt, roll)
    aim_camera = T_target_camera.actInv(np.array(aim))
    np.testing.assert_allclose(aim_camera, [0, 0, distance], atol=1e-9)
    assert T_target_camera.translation[2] > aim[2], "the camera stands in front of the print"


def test_looking_at_shows_the_print_upright() -> None:
    R = tf.looking_at([0, 0, 0], 0.5).rotation
    np.testing.assert_allclose(R, np.diag([1.0, -1.0, -1.0]), atol=1e-15)


def test_looking_at_leans_and_turns_in_the_stated_sense() -> None:
    # a lean about the target's x moves the camera to -y, one about y moves it to +x
    assert tf.looking_at([0, 0, 0], 1.0, tilt=(0.1, 0)).translation[1] == pytest.approx(
        -np.sin(0.1)
    )
    assert tf.looking_at([0, 0, 0], 1.0, tilt=(0, 0.1)).translation[0] == pytest.approx(np.sin(0.1))
    x_axis: Array = tf.looking_at([0, 0, 0], 1.0, roll=0.2).rotation[:, 0]
    np.testing.assert_allclose(x_axis, [np.cos(0.2), np.sin(0.2), 0], atol=1e-12)


def test_distances_are_in_mm_and_deg() -> None:
    T_1 = tf.translation(0.1, 0, 0) * tf.rotation("x", 0.1)
    T_2 = T_1 * tf.rotation("y", np.radians(30)) * tf.translation(0, 0, 0.003)
    assert tf.distance_mm(T_1, T_2) == pytest.approx(3.0)
    assert tf.distance_deg(T_1, T_2) == pytest.approx(30.0)


@given(vectors)
def test_mean_pose_lies_in_the_middle(rvec: tuple[float, ...]) -> None:
    T = tf.from_rvec(rvec, [1, 2, 3])
    wiggles = [tf.from_rvec(0.2 * s * np.eye(3)[i], [s, 0, 0]) for i in range(3) for s in (-1, 1)]
    assert close(tf.mean_pose([T * w for w in wiggles]), T)


def test_mean_pose_around_a_half_turn() -> None:
    down = tf.rotation("x", np.pi)
    poses = [down * tf.rotation("x", a) for a in (-0.1, 0.1)]
    assert close(tf.mean_pose(poses), down)


def test_rigid_refuses_what_is_none() -> None:
    assert tf.is_rigid(SE3.Identity())
    assert not tf.is_rigid(SE3(np.diag([1.0, 1.0, -1.0]), np.zeros(3))), "left-handed"
    assert not tf.is_rigid(SE3(1.01 * np.eye(3), np.zeros(3))), "scaled"
    assert not tf.is_rigid(SE3(np.eye(3), np.array([np.nan, 0, 0])))
    assert not tf.is_rigid(SE3(np.full((3, 3), np.nan), np.zeros(3)))
