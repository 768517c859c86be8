"""Each block of the derivatives against finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.recorded import Conditions, draw_recording

from aoicell.calibration.measurement import linearise, project_with_derivatives
from aoicell.calibration.parameters import Estimate, Model, layout_of, retract
from aoicell.calibration.problem import (
    CalibrationView,
    Eye,
    Fixture,
    PoseSight,
    Problem,
)
from aoicell.camera import Camera
from aoicell.transforms import Array, from_rvec

STEP = 1e-6


def state(problem: Problem, rng: np.random.Generator, truth: object) -> Estimate:
    """Near the truth, with every kind of parameter away from zero."""
    dof = problem.arm.dof if problem.arm else 0
    return Estimate(
        T_mount_eye=dict(truth.T_mount_eye),  # type: ignore[attr-defined]
        T_mount_fixture=dict(truth.T_mount_fixture),  # type: ignore[attr-defined]
        cameras={
            name: replace(camera, distortion=np.array([-0.1, 0.05, 1e-3, -2e-3, 0.01]))
            for name, camera in truth.cameras.items()  # type: ignore[attr-defined]
        },
        scales=dict.fromkeys(truth.scales, 1.01),  # type: ignore[attr-defined]
        deviations=2e-3 * rng.standard_normal((len(problem.views), 6)),
        joint_offsets=1e-3 * rng.standard_normal(dof),
        joint_origins=1e-3 * rng.standard_normal((dof, 5)),
    )


def by_differences(problem: Problem, model: Model, estimate: Estimate) -> tuple[Array, Array]:
    layout = layout_of(problem, model)

    def predicted(step: Array, deviations: Array) -> Array:
        moved = retract(layout, estimate, step, deviations)
        return -linearise(problem, layout, moved, derivatives=False).residuals

    d = estimate.deviations
    columns = []
    for k in range(layout.size):
        e = STEP * np.eye(layout.size)[k]
        columns.append((predicted(e, d) - predicted(-e, d)) / (2 * STEP))
    zero, by_view = np.zeros(layout.size), []
    for k in range(6):
        e = np.tile(STEP * np.eye(6)[k], (len(d), 1))
        by_view.append((predicted(zero, d + e) - predicted(zero, d - e)) / (2 * STEP))
    return np.column_stack(columns), np.column_stack(by_view)


@pytest.fixture(scope="module")
def two_boards() -> tuple[Problem, Estimate]:
    recording = draw_recording(2, Conditions(views=8, boards=("hand", "tripod")))
    rng = np.random.default_rng(0)
    return recording.problem, state(recording.problem, rng, recording.truth)


@pytest.mark.parametrize("kind", ["intrinsics", "eye", "fixture", "scale", "joints"])
def test_each_block_of_the_pixels(two_boards: tuple[Problem, Estimate], kind: str) -> None:
    problem, estimate = two_boards
    assert {(s.eye, s.fixture) for v in problem.views for s in v.sights} == {
        ("hand", "tabletarget"), ("tripod", "tabletarget"), ("tripod", "armtarget")
    }  # fmt: skip
    model = Model("k1k2p1p2k3", "joint_terms", ("tabletarget", "armtarget"))
    layout = layout_of(problem, model)
    expected, _ = by_differences(problem, model, estimate)
    found = linearise(problem, layout, estimate).J
    blocks = [where for (k, _), where in layout.blocks.items() if k == kind]
    assert blocks
    for where in blocks:
        block, size = expected[:, where], np.abs(expected[:, where]).max()
        assert size > 0
        np.testing.assert_allclose(found[:, where], block, atol=1e-6 * size)


def test_the_deviation_of_a_view(two_boards: tuple[Problem, Estimate]) -> None:
    problem, estimate = two_boards
    model = Model(robot="joint_terms")
    _, expected = by_differences(problem, model, estimate)
    found = linearise(problem, layout_of(problem, model), estimate).J_view
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_reported_poses(rng: np.random.Generator) -> None:
    fixture = Fixture("object", mount="flange")
    views = tuple(
        CalibrationView(
            f"{k}",
            from_rvec(rng.standard_normal(3), rng.standard_normal(3)),
            (PoseSight("eye", "object", from_rvec(rng.standard_normal(3), [0.1, 0.2, 0.9])),),
        )
        for k in range(3)
    )
    problem = Problem((Eye("eye", None, "base"),), (fixture,), views)
    estimate = Estimate(
        {"eye": from_rvec([0.3, 2, 0], [1, 0, 1])}, {"object": from_rvec([1, 0, 0], [0, 0.1, 0])},
        {}, {"object": 1.1}, 1e-2 * rng.standard_normal((3, 6)),
    )  # fmt: skip
    model = Model("none", "per_view", ("object",))
    expected, by_view = by_differences(problem, model, estimate)
    lin = linearise(problem, layout_of(problem, model), estimate)
    np.testing.assert_allclose(lin.J, expected, atol=1e-5 * np.abs(expected).max())
    np.testing.assert_allclose(lin.J_view, by_view, atol=1e-5 * np.abs(by_view).max())


def test_skew_is_part_of_the_derivatives(rng: np.random.Generator) -> None:
    K = np.array([[1000, 2.5, 600], [0, 1010, 500], [0, 0, 1.0]])
    camera = Camera(K, 1200, 1000, np.array([-0.1, 0.05, 1e-3, -1e-3, 0.02]))
    points = rng.uniform([-0.3, -0.2, 0.8], [0.3, 0.2, 1.2], (5, 3))
    uv, by_point, by_intrinsics = project_with_derivatives(camera, points)
    np.testing.assert_allclose(uv, camera.project(points), atol=1e-9)
    for axis in range(3):
        e = 1e-6 * np.eye(3)[axis]
        expected = (camera.project(points + e) - camera.project(points - e)) / 2e-6
        np.testing.assert_allclose(by_point[:, :, axis], expected, rtol=1e-5, atol=1e-3)
    distortion = np.array(camera.distortion)
    distortion[1] += 1e-5
    bent = replace(camera, distortion=distortion).project(points)
    expected = ((bent - uv) / 1e-5).ravel()
    np.testing.assert_allclose(by_intrinsics[:, 5], expected, rtol=1e-4, atol=1e-4)


def test_a_row_knows_its_point_its_view_and_its_sight(
    two_boards: tuple[Problem, Estimate],
) -> None:
    problem, estimate = two_boards
    lin = linearise(problem, layout_of(problem, Model()), estimate)
    assert lin.rows[-1].stop == len(lin.residuals) == lin.J.shape[0]
    np.testing.assert_array_equal(np.bincount(lin.groups), 2)
    sizes = [2 * len(s.ids) for v in problem.views for s in v.sights]
    np.testing.assert_array_equal(np.bincount(lin.sights), sizes)


def test_points_behind_the_camera_are_told(two_boards: tuple[Problem, Estimate]) -> None:
    problem, estimate = two_boards
    turned = {**estimate.T_mount_eye}
    turned["hand"] = turned["hand"] * from_rvec([np.pi, 0, 0], np.zeros(3))
    lin = linearise(problem, layout_of(problem, Model()), replace(estimate, T_mount_eye=turned))
    assert not lin.in_front
