"""Kinematics against the maker's dimensions, finite differences and round trips."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from aoicell.errors import ModelError, Unreachable
from aoicell.nominal import Nominal
from aoicell.robot import Arm
from aoicell.transforms import SE3, from_xyz_rpy, rotation


@pytest.fixture(scope="module")
def arm(nominal: Nominal) -> Arm:
    return nominal.arm


def test_at_zero_the_arm_points_along_y(arm: Arm) -> None:
    T = arm.fk(np.zeros(6))
    np.testing.assert_allclose(T.translation, [0, 0.945, 1.445], atol=1e-9)
    np.testing.assert_allclose(T.rotation[:, 2], [0, 1, 0], atol=1e-9)
    np.testing.assert_allclose(T.rotation[:, 0], [1, 0, 0], atol=1e-9)


def test_the_reach_is_in_the_models_name(arm: Arm) -> None:
    # a1 + a2 + sqrt(a3^2 + d4^2), with the wrist's centre 110 mm behind the flange
    q = np.array([0, -np.pi / 2, np.arctan2(0.685, 0.150), 0, 0, 0])
    wrist = arm.fk(q).act(np.array([0, 0, -0.110]))
    assert np.hypot(*wrist[:2]) == pytest.approx(1.6212, abs=2e-4)


@pytest.mark.parametrize(
    ("joint", "expected"),
    [(0, [-0.945, 0, 1.445]), (5, [0, 0.945, 1.445])],
    ids=["the first turns left", "the last keeps its place"],
)
def test_positive_turns(arm: Arm, joint: int, expected: list[float]) -> None:
    q = np.zeros(6)
    q[joint] = np.pi / 2
    np.testing.assert_allclose(arm.fk(q).translation, expected, atol=1e-9)


def test_limits_are_those_of_the_data_sheet(arm: Arm) -> None:
    np.testing.assert_allclose(np.degrees(arm.lower), [-170, -135, -80, -200, -130, -180], atol=0.1)
    np.testing.assert_allclose(np.degrees(arm.upper), [170, 100, 190, 200, 130, 180], atol=0.1)


def urdf_fk(urdf: Path, q: np.ndarray) -> SE3:
    """The chain multiplied out from the file, without Pinocchio's reader."""
    by_parent = {j.find("parent").get("link"): j for j in ET.parse(urdf).iter("joint")}  # type: ignore[union-attr]
    T, link, angles = SE3.Identity(), "base", iter(q)
    while link in by_parent:
        joint = by_parent[link]
        origin = joint.find("origin")
        assert origin is not None
        xyz, rpy = ([float(v) for v in origin.get(key, "0 0 0").split()] for key in ("xyz", "rpy"))
        T = T * from_xyz_rpy(xyz, rpy)
        if joint.get("type") == "revolute":
            axis = np.array([float(v) for v in joint.find("axis").get("xyz").split()])  # type: ignore[union-attr]
            T = T * SE3(pin.exp3(axis * next(angles)), np.zeros(3))
        link = joint.find("child").get("link")  # type: ignore[union-attr]
    return T


def test_forward_kinematics_is_the_chain_in_the_file(arm: Arm, rng: np.random.Generator) -> None:
    for q in rng.uniform(arm.lower, arm.upper, (50, 6)):
        expected = urdf_fk(arm.urdf, q).homogeneous
        np.testing.assert_allclose(arm.fk(q).homogeneous, expected, atol=1e-9)


def test_jacobian_against_finite_differences(arm: Arm, rng: np.random.Generator) -> None:
    h = 1e-6
    for q in rng.uniform(arm.lower, arm.upper, (10, 6)):
        columns = [
            pin.log6(arm.fk(q - h * e).actInv(arm.fk(q + h * e))).vector / (2 * h)
            for e in np.eye(6)
        ]
        np.testing.assert_allclose(arm.jacobian(q), np.column_stack(columns), atol=1e-7)


def test_inverse_kinematics_round_trip(arm: Arm, rng: np.random.Generator) -> None:
    margin = np.radians(15)
    for q in rng.uniform(arm.lower + margin, arm.upper - margin, (50, 6)):
        T = arm.fk(q)
        found = arm.ik(T, q + rng.uniform(-0.1, 0.1, 6))
        np.testing.assert_allclose(arm.fk(found).homogeneous, T.homogeneous, atol=1e-8)
        assert arm.limit_margin(found) >= 0


def test_inverse_kinematics_stays_on_the_branch(arm: Arm, nominal: Nominal) -> None:
    q = nominal.q_home
    found = arm.ik(arm.fk(q) * rotation("z", 0.3), q)
    np.testing.assert_allclose(found[:5], q[:5], atol=1e-8)
    assert found[5] - q[5] == pytest.approx(0.3)


def test_limit_margin(arm: Arm) -> None:
    q = np.zeros(6)
    assert np.degrees(arm.limit_margin(q)) == pytest.approx(80, abs=0.1)
    q[0] = np.radians(175)
    assert np.degrees(arm.limit_margin(q)) == pytest.approx(-5, abs=0.1)


def test_singularity_margin_vanishes_with_a_straight_wrist(arm: Arm, nominal: Nominal) -> None:
    straight = nominal.q_home.copy()
    straight[4] = 0
    assert arm.singularity_margin(straight) < 1e-9
    assert arm.singularity_margin(nominal.q_home) > 0.2


def test_out_of_reach_is_one_sentence(arm: Arm, nominal: Nominal) -> None:
    T = SE3(arm.fk(nominal.q_home).rotation, np.array([0, 3.0, 0.5]))
    with pytest.raises(Unreachable) as caught:
        arm.ik(T, nominal.q_home, name="P_far")
    message = str(caught.value)
    assert message.startswith("P_far: flange pose at (0, 3000, 500) mm in base is out of reach")
    assert "mm and" in message
    assert "deg away" in message
    assert "\n" not in message
    assert caught.value.exit_code == 3


def test_out_of_reach_names_the_joint_at_its_limit(arm: Arm) -> None:
    q = np.radians([0.0, -8, -23, 0, -59, 0])
    beyond = q.copy()
    beyond[0] = np.radians(180)  # J1 ends at 170
    with pytest.raises(Unreachable, match=rf"{arm.joint_names[0]} at 170 deg"):
        arm.ik(arm.fk(beyond), np.radians([160.0, -8, -23, 0, -59, 0]), name="behind")


def test_a_pose_that_is_no_pose_is_not_reached(arm: Arm, nominal: Nominal) -> None:
    with pytest.raises(Unreachable, match="nowhere"):
        arm.ik(SE3(np.eye(3), np.array([np.nan, 0, 0])), nominal.q_home, name="nowhere")


NO_FLANGE = """
<robot name="r">
  <link name="base"/><link name="tool"/>
  <joint name="j" type="fixed"><parent link="base"/><child link="tool"/></joint>
</robot>
"""


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "arm.urdf: no such file"),
        ("<robot", "arm.urdf: not a readable URDF"),
        ("", "arm.urdf: not a readable URDF"),
        (NO_FLANGE, "arm.urdf: no link is called 'flange'"),
    ],
    ids=["missing", "broken", "empty", "no flange"],
)
def test_an_unusable_urdf_is_named(tmp_path: Path, content: str | None, says: str) -> None:
    file = tmp_path / "arm.urdf"
    if content is not None:
        file.write_text(content)
    with pytest.raises(ModelError, match=says) as caught:
        Arm(file)
    assert "\n" not in str(caught.value)
