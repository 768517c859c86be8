"""The design as a geometry, and the defaults: an exact arm, sensor, light and plain surfaces."""

from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.sim.as_built import Arrival, Geometry, Light, Sensor, designed, plain_surfaces
from aoicell.transforms import from_xyz_rpy


@pytest.fixture(scope="module")
def design(nominal: Nominal) -> Geometry:
    return designed(nominal)


def test_the_design_is_the_nominal_cell(nominal: Nominal, design: Geometry) -> None:
    for name in (
        "T_flange_camera", "T_flange_armtarget", "T_base_tabletarget", "T_base_tripod",
        "T_base_board",
    ):  # fmt: skip
        found, expected = getattr(design, name), getattr(nominal, name)
        np.testing.assert_array_equal(found.homogeneous, expected.homogeneous, err_msg=name)
    assert design.cameras == nominal.cameras


def test_the_designed_arm_is_the_one_of_its_urdf(nominal: Nominal, design: Geometry) -> None:
    assert len(design.joint_corrections) == nominal.arm.dof + 1  # and the flange's
    for T in design.joint_corrections:
        np.testing.assert_array_equal(T.homogeneous, np.eye(4))
    np.testing.assert_array_equal(design.joint_offsets, np.zeros(nominal.arm.dof))


def test_the_markers_stick_where_the_board_has_them(nominal: Nominal, design: Geometry) -> None:
    assert set(design.Ts_board_marker) == {marker.id for marker in nominal.board.markers}
    for marker in nominal.board.markers:
        T = from_xyz_rpy([marker.x, marker.y, marker.z], [0, 0, marker.rotation])
        found = design.Ts_board_marker[marker.id].homogeneous
        np.testing.assert_array_equal(found, T.homogeneous)


def test_prints_are_true_to_scale_and_boards_flat(design: Geometry) -> None:
    boards = {"armtarget", "tabletarget"}
    assert design.print_scales == dict.fromkeys(boards | set(design.Ts_board_marker), (1.0, 1.0))
    assert design.bows == dict.fromkeys(boards, (0.0, 0.0))


def test_what_nothing_is_said_of_is_exact() -> None:
    for part in (Arrival(), Sensor()):
        ones = {"brightness"}
        for field in fields(part):
            assert getattr(part, field.name) == (field.name in ones), field.name
    light = Light()
    assert (light.level, light.colour) == (1, (1, 1, 1))
    assert (light.turns, light.gradient, light.flicker, light.shadows) == ((), (0, 0), 0, False)
    plain = plain_surfaces()
    assert (plain.heights, plain.brightness) == ({}, {})
    assert (plain.dust, plain.occlusion, plain.glare) == (0, 0, 0)


def test_what_is_built_stays_as_it_is(design: Geometry) -> None:
    for part in (design, Arrival(), Sensor(), Light(), plain_surfaces()):
        with pytest.raises(FrozenInstanceError):
            setattr(part, fields(part)[0].name, None)
