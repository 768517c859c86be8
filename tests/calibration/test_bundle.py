"""The joint refinement: exact data give the truth, and views weigh what they are worth."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from helpers.recorded import Conditions, Recording, draw_recording

from aoicell.calibration.bundle import Noise, Solution, refine
from aoicell.calibration.parameters import Model, conform, layout_of
from aoicell.calibration.problem import (
    CalibrationView,
    Eye,
    Fixture,
    PoseSight,
    Problem,
    Sight,
)
from aoicell.calibration.selection import fit
from aoicell.calibration.starts import sight_poses, start_estimate
from aoicell.errors import Implausible
from aoicell.transforms import (
    SE3,
    distance_deg,
    distance_mm,
    from_rvec,
    looking_at,
    rotation,
    translation,
)

QUIET = Noise(0.05, 2e-5, 5e-5)


def solved(
    recording: Recording, model: Model, noise: Noise = QUIET, tolerance: float = 1e-6
) -> Solution:
    """From the closed forms on."""
    problem = recording.problem
    posed = sight_poses(problem)
    start = start_estimate(problem, posed.poses, posed.rms_px)
    estimate = conform(problem, model, start.estimate)
    return refine(problem, layout_of(problem, model), estimate, noise, tolerance=tolerance)


@pytest.mark.parametrize("robot", ["exact", "per_view"])
def test_without_noise_everything_is_exact(robot: str) -> None:
    conditions = Conditions(views=10, sigma_px=0.0, scale=1.01)
    recording = draw_recording(1, conditions)
    model = Model(robot=robot, free_scales=("tabletarget",))  # type: ignore[arg-type]
    solution = solved(recording, model, Noise(1e-3, 1e-6, 1e-6))  # so that no prior counts
    estimate, truth = solution.estimate, recording.truth
    assert distance_mm(estimate.T_mount_eye["hand"], truth.T_mount_eye["hand"]) < 1e-3
    assert distance_deg(estimate.T_mount_eye["hand"], truth.T_mount_eye["hand"]) < 1e-4
    table = "tabletarget"
    assert distance_mm(estimate.T_mount_fixture[table], truth.T_mount_fixture[table]) < 1e-3
    assert estimate.scales[table] == pytest.approx(1.01, abs=1e-6)
    np.testing.assert_allclose(estimate.cameras["hand"].K, truth.cameras["hand"].K, atol=1e-2)
    np.testing.assert_allclose(
        estimate.cameras["hand"].distortion, truth.cameras["hand"].distortion, atol=1e-3
    )


def test_two_boards_and_two_cameras_go_into_one_solve() -> None:
    recording = draw_recording(5, Conditions(views=12, sigma_px=0.0, boards=("hand", "tripod")))
    estimate, truth = solved(recording, Model(robot="exact")).estimate, recording.truth
    for name, T in truth.T_mount_eye.items():
        assert distance_mm(estimate.T_mount_eye[name], T) < 1e-2
    for name, T in truth.T_mount_fixture.items():
        assert distance_mm(estimate.T_mount_fixture[name], T) < 1e-2


def test_an_exact_half_turn_and_pure_translations_are_nothing_special() -> None:
    camera = draw_recording(0, Conditions(views=1)).truth.cameras["hand"]
    points = draw_recording(0, Conditions(views=1)).problem.fixtures[0].points
    X, Z = translation(x=0.01, z=0.05), translation(0.3, 0.8, 0.1)
    looks = [looking_at([x, 0, 0], 0.5) for x in (-0.03, 0, 0.03)]  # straight down, and beside it
    looks += [looking_at([0, 0, 0], 0.5, tilt) for tilt in ((0.4, 0), (0, 0.4), (-0.3, 0.2))]
    views = []
    for k, look in enumerate(looks):
        A = Z * look * X.inverse()
        uv = camera.project(points, (A * X).actInv(Z))
        views.append(CalibrationView(f"{k}", A, (Sight("c", "b", np.arange(len(uv)), uv),)))
    assert distance_deg(views[0].T_base_flange, SE3.Identity()) == pytest.approx(180, abs=1e-6)
    eyes, fixtures = (Eye("c", camera, "flange", refine=False),), (Fixture("b", points),)
    problem = Problem(eyes, fixtures, tuple(views))
    posed = sight_poses(problem)
    start = start_estimate(problem, posed.poses, posed.rms_px).estimate
    off = replace(start, T_mount_eye={"c": X * pin.exp6(np.full(6, 0.02))})
    model = Model("none", "exact")
    solution = refine(problem, layout_of(problem, model), off, QUIET, tolerance=1e-12)
    assert distance_mm(solution.estimate.T_mount_eye["c"], X) < 1e-4
    assert distance_deg(solution.estimate.T_mount_fixture["b"], Z) < 1e-5


def test_reported_poses_are_refined_too(rng: np.random.Generator) -> None:
    X, Z = from_rvec([0.1, 2.0, 0], [0.6, -0.2, 0.8]), from_rvec([0, 0, 1], [0, 0.02, 0.1])
    views = []
    for k in range(20):
        A = from_rvec(rng.uniform(-1, 1, 3), rng.uniform(-0.2, 0.2, 3))
        B = X.actInv(A * Z) * pin.exp6([1e-3, 1e-3, 1e-3, 2e-3, 2e-3, 2e-3] * rng.normal(size=6))
        views.append(CalibrationView(f"{k}", A, (PoseSight("c", "o", B),)))
    problem = Problem((Eye("c", None, "base"),), (Fixture("o", mount="flange"),), tuple(views))
    posed = sight_poses(problem)
    start = start_estimate(problem, posed.poses, posed.rms_px)
    solution = fit(problem, Model("none", "exact"), start.estimate, start.noise)
    assert distance_mm(solution.estimate.T_mount_eye["c"], X) < 1.5
    assert solution.noise.sigma == pytest.approx(1.0, rel=0.25)


def test_weighting_by_repeatability_beats_plain_least_squares() -> None:
    conditions = Conditions(views=12, repeat_mm=0.017, repeat_deg=0.003, refine=False)
    errors: dict[str, list[float]] = {"per_view": [], "exact": []}
    for seed in range(4):
        recording = draw_recording(seed, conditions)
        exact = replace(recording.problem.fixtures[0], size_std=1e-5, flatness_std=1e-6)
        recording = replace(recording, problem=replace(recording.problem, fixtures=(exact,)))
        for robot, found in errors.items():
            solution = solved(recording, Model("none", robot), Noise(0.05, 1.7e-5, 5.2e-5))  # type: ignore[arg-type]
            X = solution.estimate.T_mount_eye["hand"]
            found.append(distance_mm(X, recording.truth.T_mount_eye["hand"]))
    weighted, plain = (np.sqrt(np.mean(np.square(e))) for e in errors.values())
    assert weighted < plain / 1.5
    assert weighted < 0.1


def test_wrong_points_and_a_wrong_view_hardly_count(rng: np.random.Generator) -> None:
    recording = draw_recording(3, Conditions(views=12, repeat_mm=0.017, repeat_deg=0.003))
    problem = recording.problem
    views = list(problem.views)
    uv = views[0].sights[0].uv_px.copy()  # type: ignore[union-attr]
    uv[5] += [40, -30]
    views[0] = replace(views[0], sights=(replace(views[0].sights[0], uv_px=uv),))  # type: ignore[type-var]
    moved = views[1].T_base_flange * pin.exp6(np.array([5e-3, 0, 0, 0, 0, 0.01]))
    views[1] = replace(views[1], T_base_flange=moved, q=None)
    views = [replace(v, q=None) for v in views]
    spoiled = replace(recording, problem=replace(problem, views=tuple(views), arm=None))
    posed = sight_poses(spoiled.problem)
    start = start_estimate(posed.problem, posed.poses, posed.rms_px)
    solution = fit(posed.problem, Model(), start.estimate, start.noise)
    left = posed.problem.with_views([v for v in problem.views if v.id != "v01"])
    rest = replace(solution.estimate, deviations=np.delete(solution.estimate.deviations, 1, 0))
    clean = fit(left, Model(), rest, solution.noise).estimate.T_mount_eye["hand"]
    assert solution.normal.row_weights[10] < 1e-3
    assert solution.normal.view_weights[1] < 0.05
    assert solution.normal.view_weights[2:].min() > 0.3
    assert distance_mm(solution.estimate.T_mount_eye["hand"], clean) < 0.2  # of 5 mm


def test_a_start_that_looks_the_wrong_way_is_refused() -> None:
    recording = draw_recording(0, Conditions(views=5))
    problem = recording.problem
    posed = sight_poses(problem)
    start = start_estimate(problem, posed.poses, posed.rms_px).estimate
    wrong = replace(start, T_mount_eye={"hand": start.T_mount_eye["hand"] * rotation("x", np.pi)})
    with pytest.raises(Implausible, match="behind the camera"):
        refine(problem, layout_of(problem, Model()), wrong, QUIET)
