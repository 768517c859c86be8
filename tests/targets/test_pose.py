"""Known poses are recovered, the covariance is what noise does, nonsense is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.camera import Camera
from aoicell.errors import Implausible
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.pose import (
    motion_between,
    motion_jacobian,
    planar_candidates,
    refine_pose,
    reprojection,
    rms,
    solve_pose,
)
from aoicell.transforms import SE3, Array, distance_deg, distance_mm, from_rvec, looking_at

STRAIGHT = Camera.pinhole(2667.0, 1600, 1200)
BENT = Camera(
    np.array([[2690.0, 0, 808.0], [0, 2690.0, 592.0], [0, 0, 1]]), 1600, 1200,
    np.array([-0.08, 0.01, 1e-3, -5e-4, 0]),
)  # fmt: skip
BOARD = Chessboard(8, 6, 0.015).corners
MARKER = CrossMarker().crosses


def seen(tilt_deg: tuple[float, float] = (0, 0), roll_deg: float = 0.0, distance: float = 0.5,
         aim: tuple[float, float, float] = (0, 0, 0)) -> SE3:  # fmt: skip
    """T_camera_target of a view."""
    tilt = (float(np.radians(tilt_deg[0])), float(np.radians(tilt_deg[1])))
    return looking_at(aim, distance, tilt, float(np.radians(roll_deg))).inverse()


def assert_recovered(points: Array, camera: Camera, T: SE3) -> None:
    solved = solve_pose(points, camera.project(points, T), camera)
    assert distance_mm(solved.T_camera_target, T) < 1e-6
    assert distance_deg(solved.T_camera_target, T) < 1e-6
    assert solved.rms_px < 1e-6


@pytest.mark.parametrize("camera", [STRAIGHT, BENT], ids=["straight", "bent"])
@pytest.mark.parametrize("points", [BOARD, MARKER], ids=["board", "marker"])
@pytest.mark.parametrize("roll", [0, 7, 90, 180, -135])
def test_a_camera_that_looks_straight_down(camera: Camera, points: Array, roll: float) -> None:
    assert_recovered(points, camera, seen(roll_deg=roll))


@pytest.mark.parametrize("points", [BOARD, MARKER], ids=["board", "marker"])
def test_straight_down_beside_the_target(points: Array) -> None:
    assert_recovered(points, STRAIGHT, seen(aim=(0.03, -0.02, 0)))


angles = st.floats(-35, 35)


@given(st.tuples(angles, angles), st.floats(-180, 180), st.floats(0.3, 1.2))
def test_a_tilted_camera(tilt: tuple[float, float], roll: float, distance: float) -> None:
    assert_recovered(BOARD, BENT, seen(tilt, roll, distance, (0.01, 0.02, 0)))


def test_points_that_are_not_quite_flat() -> None:
    bowed = BOARD + [[0, 0, 1]] * (0.1 * (BOARD[:, :1] ** 2 - 0.001))
    assert_recovered(bowed, STRAIGHT, seen((20, -10)))


def test_both_planar_solutions_are_offered() -> None:
    T = seen((20, 10))
    candidates = planar_candidates(MARKER, STRAIGHT.project(MARKER, T), STRAIGHT)
    assert len(candidates) == 2
    assert min(distance_deg(c, T) for c in candidates) < 1e-3
    assert distance_deg(*candidates) > 10


@pytest.mark.parametrize("camera", [STRAIGHT, BENT], ids=["straight", "bent"])
def test_the_jacobian_against_finite_differences(camera: Camera) -> None:
    T, h = seen((15, -20), 30, aim=(0.02, 0.01, 0)), 1e-6

    def moved(delta: Array) -> Array:
        turn = from_rvec(delta[:3], [0, 0, 0]).rotation
        return camera.project(MARKER, SE3(turn @ T.rotation, T.translation + delta[3:])).ravel()

    numeric = [(moved(h * e) - moved(-h * e)) / (2 * h) for e in np.eye(6)]
    np.testing.assert_allclose(
        motion_jacobian(MARKER, camera, T), np.column_stack(numeric), rtol=1e-6, atol=1e-3
    )


@pytest.mark.parametrize("tilt", [(0, 0), (25, 10)], ids=["straight down", "tilted"])
def test_the_covariance_is_what_noise_does(
    tilt: tuple[float, float], rng: np.random.Generator
) -> None:
    T, sigma, draws = seen(tilt, 7, aim=(0.01, 0, 0)), 0.05, 200
    uv = STRAIGHT.project(BOARD, T)
    errors, d2 = [], []
    for _ in range(draws):
        solved = solve_pose(BOARD, uv + sigma * rng.standard_normal(uv.shape), STRAIGHT, sigma)
        error = motion_between(T, solved.T_camera_target)
        errors.append(error)
        d2.append(error @ np.linalg.solve(solved.covariance, error))
    # chi-square with 6 degrees of freedom: the mean of 200 draws spreads by sqrt(12 / 200)
    assert np.mean(d2) == pytest.approx(6, abs=4 * np.sqrt(12 / draws))
    stated = np.sqrt(np.diag(solved.covariance))
    np.testing.assert_allclose(np.std(errors, axis=0), stated, rtol=0.2)


def test_the_covariance_grows_with_the_noise() -> None:
    T = seen((10, 5))
    uv = STRAIGHT.project(BOARD, T)
    one, two = (solve_pose(BOARD, uv, STRAIGHT, sigma).covariance for sigma in (0.1, 0.2))
    np.testing.assert_allclose(two, 4 * one, rtol=1e-6)


def test_the_ambiguity_tells_when_the_tilt_is_a_guess(rng: np.random.Generator) -> None:
    def ambiguity(T: SE3, noise: float) -> float:
        uv = STRAIGHT.project(MARKER, T)
        ratios = [
            solve_pose(MARKER, uv + noise * rng.standard_normal(uv.shape), STRAIGHT).ambiguity
            for _ in range(10)
        ]
        return float(np.median(ratios))

    assert ambiguity(seen((5, 0), distance=2.0), 0.3) < 1.5
    assert ambiguity(seen((30, 10), distance=0.3), 0.05) > 10


def test_refinement_starts_anywhere_near() -> None:
    T = seen((20, 10))
    start = from_rvec([0.1, -0.1, 0.05], [0.01, 0.01, -0.03]) * T
    refined, normal = refine_pose(BOARD, BENT.project(BOARD, T), BENT, start)
    assert distance_mm(refined, T) < 1e-6
    assert normal.shape == (6, 6)
    assert (np.linalg.eigvalsh(normal) > 0).all()


def test_reprojection_is_measured_minus_projected() -> None:
    T = seen()
    uv = STRAIGHT.project(MARKER, T) + np.array([3.0, 4.0])
    np.testing.assert_allclose(reprojection(MARKER, uv, STRAIGHT, T), np.full((4, 2), [3, 4]))
    assert rms(reprojection(MARKER, uv, STRAIGHT, T)) == pytest.approx(5)


def test_motion_between_is_in_camera_axes() -> None:
    T = seen((20, 10))
    w, d = np.array([0.01, -0.02, 0.03]), np.array([1e-3, 2e-3, 3e-3])
    moved = SE3(from_rvec(w, [0, 0, 0]).rotation @ T.rotation, T.translation + d)
    np.testing.assert_allclose(motion_between(T, moved), np.concatenate([w, d]), atol=1e-12)


def refusal(points: Array, uv_px: Array) -> str:
    with pytest.raises(Implausible) as caught:
        solve_pose(points, uv_px, STRAIGHT, name="M1")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_pixels_that_are_no_numbers_are_refused() -> None:
    assert refusal(MARKER, np.full((4, 2), np.nan)).startswith("M1: ")


def test_one_point_many_times_is_refused() -> None:
    refusal(MARKER, np.tile([[800.0, 600.0]], (4, 1)))


def test_points_on_one_line_are_refused() -> None:
    line = np.array([[x, 0, 0] for x in (0.0, 0.01, 0.02, 0.03)])
    refusal(line, STRAIGHT.project(line, seen((10, 10))))


def test_too_few_points_are_refused() -> None:
    refusal(MARKER[:3], STRAIGHT.project(MARKER[:3], seen((10, 10))))


def test_a_print_seen_from_behind_is_refused() -> None:
    # the order of the points is mirrored: they fit exactly, from the wrong side
    mirrored = BOARD * [-1, 1, 1]
    refusal(mirrored, STRAIGHT.project(BOARD, seen((20, 10))))
