"""Ways without contact: proved by a check that is finer than the planner's own."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aoicell.errors import Unreachable
from aoicell.nominal import Nominal
from aoicell.planning.path import Path, Paths
from aoicell.planning.reach import Reach
from aoicell.robot.collision import CollisionModel, Solid
from aoicell.robot.trajectories import plan
from aoicell.surroundings import collision_model, keep_out
from aoicell.transforms import Array, translation

HALF = 0.010  # of the clearance (m): what must be left between postures that were checked


@pytest.fixture(scope="module")
def reach(nominal: Nominal) -> Reach:
    return Reach(nominal)


@pytest.fixture(scope="module")
def ends(nominal: Nominal, reach: Reach) -> list[Array]:
    """Home and the taught views."""
    return [nominal.q_home, *(reach.of(view).q for view in nominal.inspection_views)]


@pytest.fixture(scope="module")
def finer(nominal: Nominal) -> CollisionModel:
    return collision_model(nominal, HALF, keep_out(nominal))


def post(nominal: Nominal, ends: list[Array], height: float) -> Solid:
    """Where the camera passes half way from home to V3."""
    T = nominal.arm.fk((ends[0] + ends[3]) / 2) * nominal.T_flange_camera
    return Solid("post", (0.03, 0.03, height), translation(*T.translation))


def finely(path: Path, step: float = np.radians(0.3)) -> Array:
    ways = [
        a + np.linspace(0, 1, int(np.abs(b - a).max() / step) + 2)[:, None] * (b - a)
        for a, b in pairwise(path.qs)
    ]
    return np.vstack(ways)


def test_a_free_way_is_straight_and_as_long_as_the_drives_need(
    nominal: Nominal, reach: Reach, ends: list[Array]
) -> None:
    path = Paths(reach).between(ends[1], ends[2])
    np.testing.assert_array_equal(path.qs, [ends[1], ends[2]])
    assert path.duration == plan(nominal.arm, ends[1], ends[2]).duration


@pytest.mark.parametrize(("height", "stops"), [(0.03, 1), (0.2, 2)])
def test_something_in_the_way_makes_another_way(
    nominal: Nominal, ends: list[Array], height: float, stops: int
) -> None:
    there = post(nominal, ends, height)
    paths = Paths(Reach(nominal, obstacles=[there]))
    pair = paths.contact(ends[0], ends[3])
    assert pair is not None
    assert "post" in pair
    path = paths.between(ends[0], ends[3])
    assert len(path.qs) == 2 + stops
    np.testing.assert_array_equal(path.qs[[0, -1]], [ends[0], ends[3]])
    assert path.duration > paths.duration(ends[0], ends[3])
    durations = [plan(nominal.arm, a, b).duration for a, b in pairwise(path.qs)]
    assert path.duration == pytest.approx(sum(durations))
    closer = collision_model(nominal, HALF, [*keep_out(nominal), there])
    assert closer.first_touch(finely(path)) is None
    assert paths.between(ends[3], ends[0]).duration == pytest.approx(path.duration)


def test_no_way_is_refused_and_what_is_in_it_named(nominal: Nominal, ends: list[Array]) -> None:
    paths = Paths(Reach(nominal, obstacles=[post(nominal, ends, 0.6)]))
    with pytest.raises(Unreachable, match=r"to V3: .* closer than 20 mm to post, ") as caught:
        paths.between(ends[0], ends[3], "from home to V3")
    assert "\n" not in str(caught.value)


angles = st.lists(st.floats(-1, 1), min_size=6, max_size=6).map(np.array)


@pytest.fixture(scope="module")
def carrying(nominal: Nominal) -> CollisionModel:
    tool = Solid("tool", (0.2, 0.5, 0.4), translation(), "flange")
    return CollisionModel(nominal.arm, [tool, Solid("far", (1, 1, 1), translation(9))])


@given(start=angles, way=angles)
@settings(max_examples=100)
def test_no_point_travels_further_than_is_told(
    nominal: Nominal, carrying: CollisionModel, start: Array, way: Array
) -> None:
    corner = np.array([0.1, -0.25, 0.2])  # of the tool, in the flange
    q = nominal.q_home + start
    places = [nominal.arm.fk(q + share * way).act(corner) for share in (0, 1)]
    assert np.linalg.norm(places[1] - places[0]) <= carrying.travel(way) + 1e-12


def test_the_bound_on_travel_is_of_the_arms_size(carrying: CollisionModel) -> None:
    turns = [carrying.travel(one) for one in np.eye(6)]
    assert turns == sorted(turns, reverse=True), "the nearer the base, the further"
    assert 1.6 + 0.3 < turns[0] < 3.2  # the arm's reach and the tool; nothing longer can be built
    assert turns[5] < 0.5


@given(pair=st.tuples(st.integers(0, 4), st.integers(0, 4)), off=angles)
@settings(max_examples=15)
def test_a_way_that_is_called_free_keeps_half_the_clearance(
    reach: Reach, finer: CollisionModel, ends: list[Array], pair: tuple[int, int], off: Array
) -> None:
    a, b = ends[pair[0]], ends[pair[1]] + 0.3 * off
    if Paths(reach).contact(a, b) is None:
        assert finer.first_touch(finely(Path(np.array([a, b]), 0.0))) is None
