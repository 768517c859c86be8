"""The procedure's poses are reachable, free of contact, and see what they must.

Under the design and under 50 draws of the profile `paper`: the arm is commanded by nominal
kinematics and goes where the drawn one goes; what it sees is projected with the drawn camera.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from aoicell.board import BoardDesign, Component
from aoicell.calibration.poses import TABLE_2
from aoicell.nominal import Nominal
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL, PAPER
from aoicell.sim.world import World
from aoicell.targets.cross_marker import CrossMarker
from aoicell.transforms import SE3, Array

DRAWS = 50
LIMIT_MARGIN_DEG = 10
SINGULARITY_MARGIN = 0.1

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]


@pytest.fixture(scope="module")
def commanded(nominal: Nominal, taught_poses: TaughtPoses) -> dict[str, Array]:
    """Joint targets by name: all taught poses, and the six of the paper's Table 2."""
    poses, arm = dict(taught_poses(nominal)), nominal.arm
    start = poses.pop("start")
    for name, motion in TABLE_2.items():
        poses[name] = arm.ik(arm.fk(start) * motion, start, f"Table 2, {name}")
    return poses


def missed(world: World, name: str) -> str:
    """What this pose has to see and does not; empty when all is well."""
    geometry = world.geometry
    camera, truth = geometry.cameras["hand"], world.truth()

    def sees(ps: Array, T_base_target: SE3) -> bool:
        return camera.sees(ps, truth.T_base_camera.actInv(T_base_target))

    if name in TABLE_2:
        outline = world.nominal.tabletarget.outline
        return "" if sees(outline, geometry.T_base_tabletarget) else "chessboard 2"
    if name == "setup":
        return ""
    seen = {
        design.id
        for design in world.nominal.board.markers
        if sees(
            CrossMarker(design.size, design.pitch).outline,
            truth.T_base_board * geometry.Ts_board_marker[design.id],
        )
    }
    roles = {design.id: design.role for design in world.nominal.board.markers}
    positioning = {id for id, role in roles.items() if role == "positioning"}
    if name == "P_check":
        return ", ".join(sorted(positioning - seen))
    if name == "overview":
        return ", ".join(sorted(set(roles) - seen))
    return "" if seen - positioning else "any measuring marker"


def faults(world: World, commanded: Mapping[str, Array]) -> list[str]:
    found = []
    for name, q in commanded.items():
        world.arrive(q)
        found += [f"{name}: {a} touches {b}" for a, b in world.contacts()]
        what = missed(world, name)
        if what:
            found.append(f"{name}: does not see {what}")
    return found


def test_the_poses_are_the_ones_of_the_procedure(commanded: dict[str, Array]) -> None:
    assert set(commanded) == {
        "A", "B", "C", "D", "E", "F", "setup", "P_check", "overview", "V1", "V2", "V3", "V4",
    }  # fmt: skip


def test_joints_keep_clear_of_limits_and_singularities(
    nominal: Nominal, commanded: dict[str, Array]
) -> None:
    for name, q in commanded.items():
        assert np.degrees(nominal.arm.limit_margin(q)) >= LIMIT_MARGIN_DEG, name
        assert nominal.arm.singularity_margin(q) > SINGULARITY_MARGIN, name


def test_the_arm_keeps_its_branch(commanded: dict[str, Array]) -> None:
    wrist = np.array([q[4] for q in commanded.values()])
    assert (np.sign(wrist) == np.sign(wrist[0])).all(), "the fifth joint never passes zero"


def test_under_the_design(nominal: Nominal, commanded: dict[str, Array]) -> None:
    world = World(nominal, draw(nominal, IDEAL, seed=0))
    assert faults(world, commanded) == []


def tallest_tower(board: BoardDesign) -> tuple[Component, ...]:
    """The tallest component and all that it stands on."""
    tower = [max(board.components, key=lambda component: component.top)]
    while tower[-1].on:
        tower.append(board.component(tower[-1].on))
    return tuple(tower)


@pytest.mark.parametrize(
    "draws", [range(10), pytest.param(range(10, DRAWS), marks=pytest.mark.slow)], ids=str
)
def test_under_draws_of_paper(nominal: Nominal, commanded: dict[str, Array], draws: range) -> None:
    # No picture is taken. So nothing is printed, the tallest component, with what it stands on,
    # stands for all (they collide as one box), and the lenses need no maps: what is seen is
    # projected with the drawn cameras all the same.
    tower = tallest_tower(nominal.board)
    bare = replace(nominal, board=replace(nominal.board, components=tower))
    found = []
    for index in draws:
        as_built = draw(nominal, PAPER, seed=0, world=index)
        straight = replace(as_built.geometry, cameras=nominal.cameras)
        world = World(bare, replace(as_built, geometry=straight), pictures=False)
        world.geometry = as_built.geometry
        found += [f"draw {index}, {fault}" for fault in faults(world, commanded)]
    assert found == []
