"""What is left after a correction, against cells drawn from the belief itself."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest

from aoicell.calibration.cell_model import CellModel
from aoicell.camera import Camera
from aoicell.first_look import Look, Reference, Sliding, expected_leftover, rigidity
from aoicell.leftover import Drift, Leftover, bound_of, motion_of, rms_of
from aoicell.nominal import Nominal
from aoicell.pipeline import flange_target
from aoicell.registration import designed_layout
from aoicell.second_look import Shown, look_again
from aoicell.targets.pose import solve_pose
from aoicell.transforms import SE3, Array, apply, from_twist, from_xyz_rpy

SIGMA_PX = 0.02
ARRIVAL = 1.6e-5
DRIFT = Drift()
DRAWS = 60


@pytest.fixture(scope="module")
def model(nominal: Nominal) -> CellModel:
    """The design, with a belief about it as a good calibration leaves it."""
    camera = nominal.cameras["hand"]
    lens = [1.5, 1.5, 1.5, 1.5, 2e-3, 2e-2, 1e-4, 1e-4]
    eye = [2e-4, 2e-4, 2e-4, 1e-4, 1e-4, 1e-4]
    joints = [1e-4] * 6 + [2e-4, 2e-4, 2e-4, 1e-4, 1e-4] * 6
    return CellModel(
        camera, nominal.T_flange_camera, nominal.arm, np.diag(np.square([*lens, *eye, *joints])),
        ARRIVAL, SIGMA_PX,
    )  # fmt: skip


@dataclass(frozen=True)
class Drawn:
    """A cell drawn from the belief: what is true in it."""

    camera: Camera
    arm: object
    T_flange_camera: SE3
    mount: SE3  # the camera on its mount now, against when it was taught
    focal: float
    rng: np.random.Generator

    def T_base_camera(self, q: Array, now: bool) -> SE3:
        """Where the camera is after one arrival."""
        arrived = q + ARRIVAL * self.rng.standard_normal(6)
        T = self.arm.fk(arrived) * self.T_flange_camera  # type: ignore[attr-defined]
        return T * self.mount if now else T

    def pixels(self, points: Array, T_camera_board: SE3, now: bool) -> Array:
        """What it sees of points on the board."""
        K = self.camera.K.copy()
        K[0, 0] *= 1 + self.focal * now
        K[1, 1] *= 1 + self.focal * now
        uv = replace(self.camera, K=K).project(points, T_camera_board)
        return np.asarray(uv + SIGMA_PX * self.rng.standard_normal(uv.shape))


def draw(model: CellModel, seed: int) -> Drawn:
    rng = np.random.default_rng(seed)
    x = np.sqrt(np.diag(model.covariance)) * rng.standard_normal(model.size)
    K, distortion = model.camera.K.copy(), np.zeros(5)
    K[[0, 1, 0, 1], [0, 1, 2, 2]] += x[:4]
    distortion[:4] = x[4:8]
    drift = np.sqrt(np.diag(DRIFT.covariance)) * rng.standard_normal(7)
    return Drawn(
        replace(model.camera, K=K, distortion=distortion),
        model.arm.corrected(x[14:20], x[20:].reshape(6, 5)),
        model.T_flange_camera * from_twist(x[8:14]),
        from_twist(drift[:6]), float(drift[6]), rng,
    )  # fmt: skip


@dataclass(frozen=True)
class Story:
    """One displacement from teaching to the corrected views, in a drawn cell."""

    leftover: Leftover
    probability: float
    cell: Drawn
    qs: list[Array]
    taught: list[SE3]  # T_camera_board of each view, as it truly was
    now: list[SE3]  # and is after the correction
    T_base_board: SE3

    @property
    def error(self) -> Array:
        """What is truly left, (6K,)."""
        gaps = [
            pin.log6(b * a.inverse()).vector for a, b in zip(self.taught, self.now, strict=True)
        ]
        return np.concatenate(gaps)


ABOUT = from_xyz_rpy([0.03, -0.02, 0.001], [0.01, -0.005, 0.2])


def play(
    model: CellModel,
    nominal: Nominal,
    seed: int,
    knock: SE3 | None = None,
    about: SE3 = ABOUT,
    markers: tuple[str, ...] = ("M1", "M2", "M3", "M4"),
    sliding: Sliding | None = None,
) -> Story:
    cell = draw(model, seed)
    if knock is not None:
        cell = replace(cell, mount=cell.mount * knock)
    layout = designed_layout(nominal.board, nominal.marker)
    points = np.concatenate([layout[id] for id in markers])
    q_look = flange_target(nominal, nominal.T_base_board, nominal.overview, nominal.q_home)
    views = nominal.inspection_views[:2]
    q_views = [flange_target(nominal, nominal.T_base_board, v, q_look) for v in views]
    T_then = nominal.T_base_board
    T_now = T_then * about

    def look(T_base_board: SE3, now: bool) -> Look:
        T = cell.T_base_camera(q_look, now).actInv(T_base_board)
        found = solve_pose(points, cell.pixels(points, T, now), model.camera).T_camera_target
        return Look(q_look, points, found, SIGMA_PX)

    def reference(distance: float) -> Reference:
        board, T_board = nominal.tabletarget, nominal.T_base_tabletarget
        start = replace(nominal.hand_eye_start, distance=distance)
        q = flange_target(nominal, T_board, start, nominal.q_home)
        uvs = [
            cell.pixels(board.corners, cell.T_base_camera(q, now).actInv(T_board), now)
            for now in (False, True)
        ]
        T = solve_pose(board.corners, uvs[0], model.camera).T_camera_target
        return Reference(q, apply(T, board.corners), uvs[1] - uvs[0], SIGMA_PX)

    taught, now = look(T_then, False), look(T_now, True)
    C = model.T_base_camera(q_look)
    motion = C * now.T_camera_board * (C * taught.T_camera_board).inverse()
    qs = [model.arm.ik(motion * model.arm.fk(q), q) for q in q_views]
    leftover, probability = expected_leftover(
        model, taught, now, q_views, qs, DRIFT, [reference(1.15), reference(0.5)], sliding
    )
    return Story(
        leftover, probability, cell, qs,
        [cell.T_base_camera(q, False).actInv(T_then) for q in q_views],
        [cell.T_base_camera(q, True).actInv(T_now) for q in qs], T_now,
    )  # fmt: skip


@pytest.fixture(scope="module")
def stories(model: CellModel, nominal: Nominal) -> list[Story]:
    return [play(model, nominal, seed) for seed in range(DRAWS)]


def distance(story: Story) -> float:
    """Squared distance of what is left from what was believed, in its own sigmas."""
    belief = story.leftover
    arrivals = np.zeros_like(belief.covariance)
    for k, arrival in enumerate(belief.arrival):
        arrivals[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = arrival
    gap = story.error - belief.mean
    return float(gap @ np.linalg.solve(belief.covariance + arrivals, gap))


def test_the_belief_holds_what_is_left(stories: list[Story]) -> None:
    """A chi-square of 12 degrees of freedom has the mean 12; a wrong sign gives thousands."""
    mean = np.mean([distance(story) for story in stories])
    assert 12 * 0.85 < mean < 12 * 1.2


def test_the_bounds_cover_as_often_as_they_say(
    stories: list[Story], model: CellModel, nominal: Nominal
) -> None:
    inside = []
    for story in stories:
        points = apply(story.taught[0], np.array([[0.05, 0.02, 0], [-0.05, 0.1, 0], [0, -0.1, 0]]))
        bound = bound_of(model, story.leftover.of(0), points)
        left = rms_of(story.error[:6] - story.leftover.mean_of(0), points) * 1e3
        inside.append((left < bound.mm_95, left < bound.mm_999))
    share_95, share_999 = np.mean(inside, axis=0)
    assert 0.85 <= share_95 <= 1
    assert share_999 >= 0.95


def test_a_second_look_leaves_less_and_knows_it(
    stories: list[Story], model: CellModel, nominal: Nominal
) -> None:
    layout = designed_layout(nominal.board, nominal.marker)
    first, second, distances = [], [], []
    for story in stories[:30]:
        shown = {}
        for k, (then, now) in enumerate(zip(story.taught, story.now, strict=True)):
            points = layout["M2" if k == 0 else "M3"]
            moved = story.cell.pixels(points, now, True) - story.cell.pixels(points, then, False)
            shown[k] = Shown(apply(then, points), moved)
        belief, probability = look_again(story.leftover, model, shown, SIGMA_PX, DRIFT)
        assert probability > 1e-4
        points = [apply(then, layout["M1"]) for then in story.taught]
        left = [rms_of(story.error[6 * k : 6 * k + 6], points[k]) for k in (0, 1)]
        after = story.error - belief.mean
        first.append(left)
        second.append([rms_of(after[6 * k : 6 * k + 6], points[k]) for k in (0, 1)])
        gap = after  # the arrival in it is the one that the pictures were taken after
        spread = belief.covariance + np.kron(np.eye(2), belief.arrival[0])
        distances.append(float(gap @ np.linalg.solve(spread, gap)))
    assert np.mean(second) < 0.6 * np.mean(first)
    assert np.mean(distances) < 12 * 1.4


def test_a_cell_that_stayed_as_it_was_is_no_contradiction(stories: list[Story]) -> None:
    assert min(story.probability for story in stories) > 1e-4


@pytest.mark.parametrize("deg", [0.05, 0.3])
def test_a_knocked_camera_contradicts_the_reference(
    model: CellModel, nominal: Nominal, deg: float
) -> None:
    for axis in range(3):
        turn = np.zeros(6)
        turn[3 + axis] = np.radians(deg)
        assert play(model, nominal, axis, from_twist(turn)).probability < 1e-6


@pytest.mark.parametrize("mm", [0.4, -1.0])
def test_a_camera_that_was_moved_along_its_axis_is_not_taken_for_a_lens_that_drifted(
    model: CellModel, nominal: Nominal, mm: float
) -> None:
    knock = from_twist(np.array([0, 0, mm / 1e3, 0, 0, 0]))
    assert max(play(model, nominal, seed, knock).probability for seed in range(4)) < 1e-2


def test_a_reference_that_something_lies_on_moves_unlike_a_whole(
    model: CellModel, nominal: Nominal, rng: np.random.Generator
) -> None:
    board, T = nominal.tabletarget, nominal.hand_eye_start.T_target_camera.inverse()
    points = apply(T, board.corners)
    J, _ = model.pixel_derivatives(points)
    moved = (J @ [1e-4, -2e-4, 3e-4, 1e-4, 2e-4, -3e-4]).reshape(-1, 2)
    moved += SIGMA_PX * np.sqrt(2) * rng.standard_normal(moved.shape)
    q = nominal.q_home
    assert rigidity(model, Reference(q, points, moved, SIGMA_PX)) > 1e-3
    moved[5] += 0.5
    assert rigidity(model, Reference(q, points, moved, SIGMA_PX)) < 1e-6


SLID = from_xyz_rpy([0.03, -0.02, 0.0], [0.0, 0.0, 0.2])
LIFTED = from_xyz_rpy([0.03, -0.02, 0.002], [np.radians(1), 0.0, 0.2])


def test_two_markers_are_helped_by_a_board_that_slid(model: CellModel, nominal: Nominal) -> None:
    """Markers in a row tell the tilt about it badly; that the board lies flat tells it well."""
    free, held, distances = [], [], []
    for seed in range(20):
        alone = play(model, nominal, seed, about=SLID, markers=("M1", "M2"))
        flat = play(model, nominal, seed, about=SLID, markers=("M1", "M2"), sliding=Sliding())
        points = apply(flat.taught[0], designed_layout(nominal.board, nominal.marker)["M3"])
        free.append(rms_of(alone.error[:6], points))
        held.append(rms_of((flat.error - flat.leftover.mean)[:6], points))
        distances.append(distance(flat))
    # medians: from so far few markers are now and then taken for their mirror image
    assert np.median(held) < 0.75 * np.median(free)
    assert np.median(distances) < 12 * 1.4


def test_a_board_that_was_lifted_is_not_taken_to_have_slid(
    model: CellModel, nominal: Nominal
) -> None:
    for seed in range(5):
        free = play(model, nominal, seed, about=LIFTED)
        asked = play(model, nominal, seed, about=LIFTED, sliding=Sliding())
        np.testing.assert_array_equal(free.leftover.covariance, asked.leftover.covariance)
        np.testing.assert_array_equal(free.leftover.mean, asked.leftover.mean)


def test_points_move_with_a_twist() -> None:
    twist = 1e-6 * np.array([1.0, -2, 3, 4, -5, 6])
    points = np.array([[0.1, 0.2, 0.5], [-0.3, 0.1, 0.7]])
    moved = apply(from_twist(twist), points) - points
    np.testing.assert_allclose(motion_of(points) @ twist, moved.ravel(), atol=1e-10)
    assert rms_of(twist, points) == pytest.approx(np.sqrt((moved**2).sum(axis=1).mean()), rel=1e-4)
