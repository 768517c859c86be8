"""Programs as planned and as carried out: MuJoCo drives them, and the pictures prove them."""

from collections.abc import Iterator

import numpy as np
import pytest
from helpers.fence import fenced
from helpers.programs import TWO_VIEWS

from aoicell.errors import InputError, Unreachable
from aoicell.nominal import Nominal, View
from aoicell.observation import capture_at
from aoicell.planning.program import Capture, Move, Planned, execute, in_degrees, plan_program
from aoicell.planning.reach import Reach, ReachConfig
from aoicell.robot.collision import Solid
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL
from aoicell.sim.world import World
from aoicell.transforms import SE3, distance_deg, distance_mm, rotation, translation

AWAY = View("away", 0.5, aim=(0.0, 2.0, 0.0))


@pytest.fixture(scope="module")
def planned(nominal: Nominal) -> Planned:
    return plan_program(nominal, nominal.inspection_views)


def assert_shows(world: World, pictures: dict, views: tuple[View, ...], T_base_board: SE3) -> None:
    """Each picture was taken from where its view asks for."""
    for view in views:
        truth = world.truth_of(pictures[view.id])
        T_board_camera = T_base_board.actInv(truth.T_base_camera)
        assert distance_mm(T_board_camera, view.T_target_camera) < 1e-3
        assert distance_deg(T_board_camera, view.T_target_camera) < 1e-4


# -- Planned ----------------------------------------------------


def test_it_is_a_round_trip_with_a_picture_of_each_view(planned: Planned, nominal: Nominal) -> None:
    program = planned.program
    assert program.start_deg == program.moves[-1].joints_deg == in_degrees(nominal.q_home)
    assert sorted(program.views) == [view.id for view in nominal.inspection_views]
    assert program.views == tuple(visit.view.id for visit in planned.visits)
    at = None
    for step in program.steps:
        if isinstance(step, Capture):
            assert at == step.view, "each picture is taken where its move leads"
        at = step.to if isinstance(step, Move) else at


def test_the_order_is_no_longer_than_the_given_one(planned: Planned, nominal: Nominal) -> None:
    assert planned.program.duration < planned.given_duration
    views = [visit.view for visit in planned.visits]
    again = plan_program(nominal, views)
    assert again.program.duration == pytest.approx(planned.program.duration)
    assert again.given_duration == pytest.approx(planned.program.duration)


def test_something_in_the_way_adds_moves_that_are_named(planned: Planned, nominal: Nominal) -> None:
    first = planned.program.moves[0]
    T = nominal.arm.fk(nominal.q_home + 0.4 * (first.q - nominal.q_home)) * nominal.T_flange_camera
    post = Solid("post", (0.03, 0.03, 0.03), translation(*T.translation))
    around = plan_program(nominal, nominal.inspection_views, obstacles=[post])
    assert around.program.duration > planned.program.duration
    assert any(move.to.startswith("on the way to ") for move in around.program.moves)
    assert around.given_duration >= around.program.duration


def test_all_views_out_of_reach_are_told(nominal: Nominal) -> None:
    near = View("near", 0.03)
    with pytest.raises(Unreachable, match=r"2 of 3 views .*: away: .*; near: ") as caught:
        plan_program(nominal, [AWAY, nominal.inspection_views[0], near])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["", "../V1", ".V1", "V 1", "V1\n", "é"])
def test_a_view_whose_name_is_no_file_name(nominal: Nominal, name: str) -> None:
    with pytest.raises(InputError, match="its name must be letters, digits"):
        plan_program(nominal, [View(name, 0.5)])


def test_a_name_that_is_there_twice(nominal: Nominal) -> None:
    with pytest.raises(InputError, match="view 'V1' is there twice"):
        plan_program(nominal, [View("V1", 0.5), View("V1", 0.6)])


def test_home_must_be_free(nominal: Nominal) -> None:
    lens = nominal.arm.fk(nominal.q_home) * nominal.T_flange_camera
    lamp = Solid("lamp", (0.1, 0.1, 0.1), lens * translation(z=0.05))
    with pytest.raises(Unreachable, match=r"home: .* to lamp"):
        plan_program(nominal, nominal.inspection_views, obstacles=[lamp])


def test_no_views_no_steps(nominal: Nominal) -> None:
    nothing = plan_program(nominal, [])
    assert (nothing.program.steps, nothing.given_duration) == ((), 0.0)


# -- Carried out ----------------------------------------------------


def test_mujoco_drives_it_and_the_pictures_show_the_views(
    planned: Planned, nominal: Nominal, ideal_world: World
) -> None:
    pictures = execute(planned.program, fenced(SimCell(ideal_world)))
    assert tuple(pictures) == planned.program.views
    assert_shows(ideal_world, dict(pictures), nominal.inspection_views, nominal.T_base_board)
    arrival, sensor = ideal_world.as_built.arrival, ideal_world.as_built.sensors["hand"]
    pauses = len(planned.program.moves) * arrival.wait + len(pictures) * sensor.exposure
    assert ideal_world.clock == pytest.approx(planned.program.duration + pauses)


def test_mujoco_drives_every_way_among_many_views(
    nominal: Nominal, ideal_world: World, rng: np.random.Generator
) -> None:
    reach, views = Reach(nominal), list[View]()
    while len(views) < 14:  # more than are ordered exactly
        x, y, tilt_x, tilt_y = rng.uniform([-0.2, -0.15, -0.5, -0.5], [0.2, 0.15, 0.5, 0.5])
        roll = rng.uniform(-np.pi, np.pi)
        view = View(f"{len(views)}", rng.uniform(0.2, 0.7), (tilt_x, tilt_y), roll, (x, y, 0.0))
        views += [view] if reach.reaches(view) else []
    planned = plan_program(nominal, views)
    assert planned.program.duration <= planned.given_duration
    cell = SimCell(ideal_world)
    for move in planned.program.moves:
        cell.move(move.q)


def test_the_pictures_are_those_of_the_same_joint_angles(ideal_world: World) -> None:
    cell = SimCell(ideal_world)
    pictures = execute(TWO_VIEWS, cell)
    ideal_world.begin()
    stops = [move.q for move in TWO_VIEWS.moves]
    for view, other in zip(("V1", "V4"), capture_at(cell, stops)[1:3], strict=True):
        np.testing.assert_array_equal(pictures[view].state.q, other.state.q)
        np.testing.assert_array_equal(pictures[view].image, other.image)


def test_a_board_that_lies_elsewhere(nominal: Nominal, ideal_world: World) -> None:
    T = nominal.T_base_board * translation(-0.04, 0.03) * rotation("z", -0.2)
    views = nominal.inspection_views[:2]
    moved = plan_program(nominal, views, T_base_board=T)
    ideal_world.place_board(T)
    pictures = execute(moved.program, SimCell(ideal_world))
    assert_shows(ideal_world, dict(pictures), views, T)


def test_from_elsewhere_it_does_not_start(planned: Planned, ideal_world: World) -> None:
    cell = SimCell(ideal_world)
    cell.move(ideal_world.nominal.q_home + np.radians([0, 0, 0, 0, 0, 0.2]))
    before = ideal_world.clock
    with pytest.raises(InputError, match=r"starts at \(20.0, .*the arm stands at .*-67.8\) deg"):
        execute(planned.program, cell)
    assert ideal_world.clock == before


@pytest.fixture(scope="module")
def other_world(second_cell: Nominal) -> Iterator[World]:
    world = World(second_cell, draw(second_cell, IDEAL, seed=0))
    yield world
    world.close()


def test_another_arm(second_cell: Nominal, other_world: World) -> None:
    views = second_cell.inspection_views
    config = ReachConfig(limit_deg=5)  # joint 3 has no more at V2
    planned = plan_program(second_cell, views, config=config)
    pictures = execute(planned.program, SimCell(other_world))
    assert_shows(other_world, dict(pictures), views, second_cell.T_base_board)
