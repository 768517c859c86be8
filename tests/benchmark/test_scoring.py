"""Scores from truth, on poses made by hand."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pytest

from aoicell.benchmark.scoring import arm_floor_mm, residual_vectors, score_view, visible_points
from aoicell.nominal import Nominal
from aoicell.observation import Observation
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.projection import PicturelessCell
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.targets.detector import IN_PICTURES
from aoicell.transforms import SE3, Array, apply, looking_at, rotation, translation

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]

RP_MM = 0.36  # ISO 9283; 0.1 mm of sigma along each axis


@pytest.fixture(scope="module")
def loose_world(nominal: Nominal) -> Iterator[World]:
    """An exact cell whose arm does not arrive exactly."""
    world = World(nominal, draw(nominal, Tolerances(repeatability_mm=RP_MM), seed=1), False)
    yield world
    world.close()


def standards(world: World, poses: Mapping[str, Array]) -> list[Observation]:
    """The taught views' instants; no picture is looked at."""
    cell = PicturelessCell(world)
    pictures = []
    for id in ("V1", "V2", "V3", "V4"):
        cell.move(poses[id])
        pictures.append(cell.capture())
    return pictures


def test_a_residual_points_from_where_it_was_to_where_it_is() -> None:
    taught = looking_at([0, 0, 0], 0.5).inverse()
    points = np.array([[0, 0, 0], [0.1, 0, 0]])
    # the camera went 1 mm to the board's +x: the board goes to the picture's left
    moved = (translation(1e-3) * taught.inverse()).inverse()
    np.testing.assert_allclose(
        residual_vectors(taught, moved, points), [[-1e-3, 0, 0]] * 2, atol=1e-15
    )
    # 2 mm higher: farther away
    moved = (translation(z=2e-3) * taught.inverse()).inverse()
    np.testing.assert_allclose(
        residual_vectors(taught, moved, points), [[0, 0, 2e-3]] * 2, atol=1e-15
    )


def test_a_turn_acts_with_its_lever() -> None:
    taught = looking_at([0, 0, 0], 0.5).inverse()
    turned = taught * rotation("z", 0.01)
    vectors = residual_vectors(taught, turned, np.array([[0, 0, 0], [0.2, 0, 0]]))
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), [0, 0.2 * 0.01], rtol=1e-4)


def scored(world: World, poses: Mapping[str, Array], motion: SE3) -> tuple[object, SE3, SE3]:
    """The view V2 taught, then photographed again after the board was moved in camera axes."""
    cell = SimCell(world)
    cell.move(poses["V2"])
    standard = cell.capture()
    before = world.truth()
    world.place_board(before.T_base_camera * motion * before.T_camera_board)
    new = cell.capture()
    record = score_view(world, "V2", standard, new, IN_PICTURES)
    return record, before.T_camera_board, world.truth().T_camera_board


@pytest.mark.parametrize(
    ("motion", "lateral", "depth", "deg"),
    [
        (translation(0.3e-3, 0.4e-3), 0.5, 0.0, 0.0),
        (translation(z=-0.7e-3), 0.0, 0.7, 0.0),
        (translation(0.3e-3, -0.4e-3, 1.2e-3), 0.5, 1.2, 0.0),
    ],
)
def test_lateral_and_depth_are_those_of_the_camera(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses,
    motion: SE3, lateral: float, depth: float, deg: float,
) -> None:  # fmt: skip
    record, before, after = scored(ideal_world, taught_poses(nominal), motion)
    assert record.id == "V2"
    assert record.lateral_mm == pytest.approx(lateral, abs=1e-9)
    assert record.depth_mm == pytest.approx(depth, abs=1e-9)
    assert record.residual_mm == pytest.approx(np.hypot(lateral, depth), abs=1e-9)
    assert record.deg == pytest.approx(deg, abs=1e-5)
    (marker,) = record.markers
    assert marker.id == "M3"
    crosses = ideal_world.marker_points("M3", nominal.marker.crosses)
    camera = nominal.cameras["hand"]
    moved = camera.project(crosses, after) - camera.project(crosses, before)
    assert marker.true_px == pytest.approx(np.linalg.norm(moved, axis=1).mean(), abs=1e-9)
    assert marker.detected_px == pytest.approx(marker.true_px, abs=0.04)
    seen = np.subtract(marker.new_uv_px, marker.standard_uv_px)
    np.testing.assert_allclose(seen, moved, atol=0.1)
    if depth == 0:  # pixels times the local scale are millimetres across the view
        assert marker.image_mm == pytest.approx(lateral, abs=0.02)


def test_a_turn_is_stated_in_degrees(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    record, before, _ = scored(ideal_world, taught_poses(nominal), rotation("z", np.radians(0.2)))
    assert record.deg == pytest.approx(0.2, abs=1e-6)
    points = apply(before, visible_points(ideal_world, ideal_world.truth()))
    assert record.lateral_mm == pytest.approx(
        1e3 * np.radians(0.2) * np.linalg.norm(points[:, :2], axis=1).mean(), rel=0.05
    )
    assert record.depth_mm == pytest.approx(0, abs=1e-9)


def test_a_marker_that_has_left_the_picture_has_no_pixels(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    record, _, _ = scored(ideal_world, taught_poses(nominal), translation(-0.4))
    (marker,) = record.markers
    assert marker.detected_px is None
    assert marker.image_mm is None
    assert marker.new_uv_px is None
    assert marker.standard_uv_px is not None
    assert record.lateral_mm == pytest.approx(400)


def test_the_scored_points_are_tops_of_components_in_the_view(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    ideal_world.arrive(taught_poses(nominal)["V1"])
    points = visible_points(ideal_world, ideal_world.truth())
    tops = {(c.x, c.y, c.top) for c in nominal.board.components}
    assert {tuple(p) for p in points} < tops
    assert len(points) >= 10
    uv = ideal_world.project(points)
    assert (uv >= 0).all()
    assert (uv <= [1599, 1199]).all()
    assert np.ptp(uv, axis=0) == pytest.approx([1300, 950], abs=350)  # spread over the view


def test_an_exact_arm_has_no_floor(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    pictures = standards(ideal_world, taught_poses(nominal))
    assert arm_floor_mm(ideal_world, pictures) == pytest.approx(0, abs=1e-9)


def test_the_floor_is_that_of_two_arrivals(
    loose_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    """Linear theory: what the joints' scatter does to the scored points, twice."""
    world, poses = loose_world, taught_poses(nominal)
    pictures = standards(world, poses)
    found = arm_floor_mm(world, pictures, repeats=200)
    expected, rng = [], np.random.default_rng(0)
    for picture in pictures:
        J, q = nominal.arm.jacobian(picture.state.q), picture.state.q
        sigma = RP_MM / 1e3 / 3.6 / np.sqrt((J[:3] ** 2).sum() / 3)
        ps = apply(
            nominal.arm.fk(q).actInv(world.T_base_board),
            visible_points(world, world.truth_of(picture)),
        )
        twists = (np.sqrt(2) * sigma * rng.standard_normal((400, 6))) @ J.T
        moved = twists[:, None, :3] + np.cross(twists[:, None, 3:], ps[None])
        expected.append(1e3 * np.linalg.norm(moved, axis=2).mean())
    assert found == pytest.approx(np.mean(expected), rel=0.1)
    # about sqrt(2) sigma over three axes, and the lever from the flange to the board
    assert 0.1 < found < 0.6
    assert arm_floor_mm(world, pictures, 5) == arm_floor_mm(world, pictures, 5)
