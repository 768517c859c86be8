"""Frames stand where the truth and where the estimates put them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from aoicell.nominal import Nominal
from aoicell.sim.meshes import Posture, Puppet
from aoicell.sim.world import World
from aoicell.transforms import SE3, apply, from_rvec
from aoicell.view.frames import Belief, believed_axes, marker_pose, true_axes

numbers = st.floats(-3, 3)


@given(st.tuples(numbers, numbers, numbers), st.tuples(numbers, numbers, numbers))
def test_a_marker_is_placed_by_its_crosses(
    rvec: tuple[float, ...], tvec: tuple[float, ...]
) -> None:
    design = 0.018 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
    T = from_rvec(rvec, tvec)
    assert marker_pose(apply(T, design), design).isApprox(T, 1e-6)


def test_true_frames_are_those_of_the_world(paper_world: World) -> None:
    world = paper_world
    Ts_world_body = Puppet(world.model).Ts_world_body(Posture.of(world.data))
    placed = {a.name: Ts_world_body[a.body] * a.T_body_frame for a in true_axes(world)}
    T_world_base = world.nominal.T_world_base
    T_board = T_world_base * world.T_base_board
    expected = {
        "base": T_world_base,
        "flange": T_world_base * world.T_base_body("arm/flange"),
        "camera": T_world_base * world.truth().T_base_camera,
        "tripod": T_world_base * world.geometry.T_base_tripod,
        "board": T_board,
        **{id: T_board * T for id, T in world.geometry.Ts_board_marker.items()},
    }
    assert set(expected) <= set(placed)
    for name, T in expected.items():
        assert placed[name].isApprox(T, 1e-9), name


def test_at_first_only_the_flange_is_believed_to_be_somewhere(nominal: Nominal) -> None:
    [flange] = believed_axes(nominal, Belief(), nominal.q_home)
    assert flange.estimate
    expected = nominal.T_world_base * nominal.arm.fk(nominal.q_home)
    assert flange.T_body_frame.isApprox(expected, 1e-12)


def test_a_located_board_carries_its_layout(nominal: Nominal) -> None:
    T_base_board = SE3(np.eye(3), np.array([0.1, 0.7, 0.4]))
    crosses = nominal.marker.crosses + np.array([0.05, 0.02, 0.0])
    axes = believed_axes(nominal, Belief(None, T_base_board, {"M9": crosses}), nominal.q_home)
    marker = next(a for a in axes if a.name == "M9")
    moved = SE3(np.eye(3), np.array([0.05, 0.02, 0.0]))
    assert marker.T_body_frame.isApprox(nominal.T_world_base * T_base_board * moved, 1e-9)
