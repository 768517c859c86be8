"""`SimCell` is the protocol and nothing else: the truth is not to be reached through it."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from aoicell.errors import Unreachable
from aoicell.nominal import Nominal
from aoicell.observation import Cell, Observation, capture_at
from aoicell.robot.trajectories import plan
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.transforms import Array, distance_mm, translation

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]


def test_nothing_but_the_protocol_is_public(ideal_world: World) -> None:
    cell = SimCell(ideal_world)
    protocol = {name for name in vars(Cell) if not name.startswith("_")}
    assert protocol == {"move", "state", "capture"}
    assert {name for name in dir(cell) if not name.startswith("_")} == protocol
    assert not hasattr(cell, "__dict__")
    assert set(SimCell.__slots__) == {"_world", "_colour"}


def test_an_observation_carries_no_truth(ideal_world: World) -> None:
    observation = SimCell(ideal_world).capture()
    assert set(vars(observation)) - {"grey"} == {"image", "state", "camera"}
    assert set(vars(observation.state)) == {"q", "T_base_flange"}


def test_the_state_is_the_controllers_belief(paper_world: World, nominal: Nominal) -> None:
    cell = SimCell(paper_world)
    q = nominal.q_home + 0.02
    cell.move(q)
    state = cell.state()
    np.testing.assert_array_equal(state.q, q)
    np.testing.assert_array_equal(state.T_base_flange.homogeneous, nominal.arm.fk(q).homogeneous)
    assert distance_mm(state.T_base_flange, paper_world.T_base_body("arm/flange")) > 0.05


def test_the_belief_is_no_alias(ideal_world: World, nominal: Nominal) -> None:
    cell, q = SimCell(ideal_world), nominal.q_home.copy()
    cell.move(q)
    q += 1
    np.testing.assert_array_equal(cell.state().q, nominal.q_home)


@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_move_beyond_a_limit_is_refused_by_name(
    ideal_world: World, nominal: Nominal, side: str
) -> None:
    cell, arm = SimCell(ideal_world), nominal.arm
    cell.move(nominal.q_home)
    q = nominal.q_home.copy()
    q[2] = getattr(arm, side)[2] + (0.02 if side == "upper" else -0.02)
    with pytest.raises(Unreachable, match=f"{arm.joint_names[2]}: commanded") as caught:
        cell.move(q)
    for limit in (arm.lower[2], arm.upper[2]):
        assert f"{np.degrees(limit):.0f}" in str(caught.value)
    np.testing.assert_array_equal(cell.state().q, nominal.q_home)


def test_a_move_to_no_number_is_refused(ideal_world: World, nominal: Nominal) -> None:
    q = nominal.q_home.copy()
    q[4] = np.nan
    with pytest.raises(Unreachable, match=nominal.arm.joint_names[4]):
        SimCell(ideal_world).move(q)


# ---- the way to a pose --------------------------------------------------------------------------

# Both are free of contact; the tripod's legs stand between them.
BESIDE = np.radians([0, -20, 0, 0, -60, 0])
BEYOND = np.radians([110, -20, 0, 0, -60, 0])


def test_a_move_into_something_is_refused_before_it_starts(
    paper_world: World, nominal: Nominal
) -> None:
    cell = SimCell(paper_world)
    for q in (BEYOND, BESIDE):
        paper_world.arrive(q)
        assert paper_world.contacts() == []
    before = (paper_world.T_base_body("hand"), paper_world.clock)
    with pytest.raises(
        Unreachable, match=r"armtarget would touch tripod_legs after 4\d% of"
    ) as caught:
        cell.move(BEYOND)
    assert "\n" not in str(caught.value)
    np.testing.assert_array_equal(cell.state().q, BESIDE)
    assert (paper_world.T_base_body("hand"), paper_world.clock) == before


def test_the_place_in_the_message_is_on_the_path(ideal_world: World, nominal: Nominal) -> None:
    ideal_world.arrive(BESIDE)
    with pytest.raises(Unreachable) as caught:
        SimCell(ideal_world).move(BEYOND)
    share = int(re.search(r"after (\d+)%", str(caught.value))[1]) / 100  # type: ignore[index]
    place = re.search(r"at \((-?\d+), (-?\d+), (-?\d+)\) mm", str(caught.value))
    q = BESIDE + share * (BEYOND - BESIDE)
    expected = nominal.arm.fk(q).translation * 1e3
    np.testing.assert_allclose([float(g) for g in place.groups()], expected, atol=15)  # type: ignore[union-attr]
    ideal_world.arrive(q)
    assert ("armtarget", "tripod_legs") in ideal_world.contacts()


def test_a_refused_move_draws_nothing(paper_world: World, nominal: Nominal) -> None:
    cell, found = SimCell(paper_world), []
    for refused in (False, True):
        paper_world.begin()
        cell.move(BESIDE)
        if refused:
            with pytest.raises(Unreachable):
                cell.move(BEYOND)
        cell.move(nominal.q_home)
        found.append(paper_world.T_base_body("hand").homogeneous.tobytes())
    assert found[0] == found[1]


def test_the_board_is_in_the_way_where_it_now_is(
    ideal_world: World, taught_poses: TaughtPoses, nominal: Nominal
) -> None:
    cell, poses = SimCell(ideal_world), taught_poses(nominal)
    cell.move(poses["V2"])
    T_base_board = ideal_world.T_base_board
    camera, board = ideal_world.T_base_body("hand").translation, T_base_board.translation
    cell.move(poses["overview"])
    ideal_world.place_board(translation(*(camera - board)) * T_base_board)
    assert ideal_world.contacts() == []
    with pytest.raises(Unreachable, match=r"\w+ would touch board after"):
        cell.move(poses["V2"])
    ideal_world.place_board(T_base_board)
    cell.move(poses["V2"])


def test_it_is_the_arm_as_built_that_must_not_touch(nominal: Nominal) -> None:
    as_built = draw(nominal, IDEAL, seed=0)
    offsets = np.radians([15, 0, 0, 0, 0, 0])
    turned = replace(as_built.geometry, joint_offsets=offsets)
    world = World(nominal, replace(as_built, geometry=turned))
    free = BESIDE + 0.36 * (BEYOND - BESIDE)
    world.arrive(BESIDE)
    with pytest.raises(Unreachable, match="tripod_legs"):
        SimCell(world).move(free)
    world.arrive(free - offsets)
    assert world.contacts() == []
    world.close()


def test_the_clock_counts_moves_pauses_and_exposures(nominal: Nominal) -> None:
    knobs = Tolerances(wait_ms=300, exposure_ms=5)
    world = World(nominal, draw(nominal, knobs, seed=0))
    cell, q = SimCell(world), nominal.q_home + 0.1
    assert world.clock == 0
    cell.move(q)
    travel = plan(nominal.arm, nominal.q_home, q).duration
    assert 0.1 < travel < 1
    assert world.clock == pytest.approx(travel + 0.3)
    cell.capture()
    assert world.clock == pytest.approx(travel + 0.305)
    world.begin(3)
    assert world.clock == 0
    world.close()


def test_every_trial_begins_at_home_and_with_no_past(
    paper_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    cell, poses, found = SimCell(paper_world), taught_poses(nominal), []
    for past in ("setup", "V2"):
        cell.move(poses[past])
        paper_world.begin(5)
        np.testing.assert_array_equal(cell.state().q, nominal.q_home)
        cell.move(poses["P_check"])
        found.append(paper_world.T_base_body("hand").homogeneous.tobytes())
    assert found[0] == found[1]


def test_pictures_are_grey_or_coloured(ideal_world: World) -> None:
    grey = SimCell(ideal_world).capture()
    colour = SimCell(ideal_world, colour=True).capture()
    assert grey.image.shape == (1200, 1600)
    assert colour.image.shape == (1200, 1600, 3)
    np.testing.assert_array_equal(colour.grey, grey.image)
    assert grey.camera == "hand"


def test_the_tripod_has_a_picture_of_its_own(ideal_world: World) -> None:
    observation = SimCell(ideal_world).capture("tripod")
    assert observation.camera == "tripod"
    assert (observation.image != SimCell(ideal_world).capture().image).any()


def test_the_truth_of_a_picture_is_that_of_its_instant(
    paper_world: World, nominal: Nominal
) -> None:
    cell = SimCell(paper_world)
    cell.move(nominal.q_home)
    expected = paper_world.truth()
    observation = cell.capture()
    cell.move(nominal.q_home + 0.05)
    paper_world.place_board(paper_world.T_base_board * translation(0.03))
    later = cell.capture()
    found = paper_world.truth_of(observation)
    for name in ("T_base_camera", "T_base_board", "T_camera_board"):
        np.testing.assert_array_equal(
            getattr(found, name).homogeneous, getattr(expected, name).homogeneous
        )
    assert distance_mm(paper_world.truth_of(later).T_base_board, found.T_base_board) > 29


def test_a_world_knows_its_own_observations_only(paper_world: World, nominal: Nominal) -> None:
    observation = SimCell(paper_world).capture()
    copy = Observation(observation.image, observation.state)
    with pytest.raises(KeyError):
        paper_world.truth_of(copy)


def test_capture_at_visits_one_after_the_other(ideal_world: World, nominal: Nominal) -> None:
    qs = [nominal.q_home, nominal.q_home + 0.03]
    observations = capture_at(SimCell(ideal_world), qs)
    for q, observation in zip(qs, observations, strict=True):
        np.testing.assert_array_equal(observation.state.q, q)
    assert (observations[0].image != observations[1].image).any()


def test_the_second_arm(second_cell: Nominal, taught_poses: TaughtPoses) -> None:
    world = World(second_cell, draw(second_cell, IDEAL, seed=0))
    poses = taught_poses(second_cell)
    assert len(poses) == 4 + len(second_cell.inspection_views)
    for name, q in poses.items():
        world.arrive(q)
        assert world.contacts() == [], name
        assert np.degrees(second_cell.arm.limit_margin(q)) > 5, name
    cell = SimCell(world)
    cell.move(poses["start"])
    uv = second_cell.tabletarget.detect(cell.capture().grey)
    T = world.truth().T_base_camera.actInv(second_cell.T_base_tabletarget)
    expected = second_cell.cameras["hand"].project(second_cell.tabletarget.corners, T)
    off = min(np.abs(uv - expected).max(), np.abs(uv[::-1] - expected).max())
    assert off < 0.1
    world.close()
