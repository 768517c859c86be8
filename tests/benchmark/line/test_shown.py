"""What no picture shows is neither found nor missed."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from aoicell.benchmark.line.scoring import _shown_parts
from aoicell.benchmark.records import InspectionRecord
from aoicell.inspection import BoardInspection, Finding
from aoicell.nominal import Nominal
from aoicell.observation import Observation
from aoicell.sim.defects import Defect
from aoicell.sim.drawing import draw
from aoicell.sim.population import Population
from aoicell.sim.profiles import IDEAL
from aoicell.sim.projection import PicturelessCell
from aoicell.sim.world import World
from benchmark.line.test_scoring import part


@pytest.fixture(scope="module")
def world(nominal: Nominal) -> Iterator[World]:
    world = World(nominal, draw(nominal, IDEAL, 0), pictures=False)
    yield world
    world.close()


@pytest.fixture(scope="module")
def picture(world: World) -> Observation:
    """Of the view V1, which aims at (95, 78) mm of the board."""
    nominal = world.nominal
    T_base_camera = nominal.T_base_board * nominal.inspection_views[0].T_target_camera
    q = nominal.arm.ik(T_base_camera * nominal.T_flange_camera.inverse(), nominal.q_home, "V1")
    cell = PicturelessCell(world)
    cell.move(q)
    return cell.capture()


def test_parts_and_foreign_objects_out_of_view_are_left_out(
    world: World, picture: Observation
) -> None:
    near = Defect("foreign_object", "F1", (0.095, 0.078))
    far = replace(near, component="F2", shift=(-0.15, -0.1))
    board = world.nominal.board
    population = Population(board, board, {}, {}, {}, (near, far))
    parts = [part("R1", "missing"), part("R2", "missing"), part("F1", near.kind),
             part("F2", far.kind), part("foreign 1", "")]  # fmt: skip
    record = InspectionRecord("pass", 1, 0, 0, parts, [])
    inspection = BoardInspection("pass", {"R1": Finding("R1", "absent")}, (), {})
    shown = _shown_parts(record, inspection, population, world, {"V1": picture})
    assert [p.component for p in shown] == ["R1", "F1", "foreign 1"]
    assert _shown_parts(None, None, population, world, {}) == []
