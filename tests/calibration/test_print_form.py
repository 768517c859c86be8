"""Prints that are bent and stretched: shapes, and a calibration that is not misled by them."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.recorded import Conditions, Recording, cell, draw_recording

from aoicell.calibration.calibrate import CalibrationConfig, calibrate
from aoicell.calibration.measurement import linearise
from aoicell.calibration.parameters import Model, conform, layout_of, retract
from aoicell.calibration.print_form import form_basis, form_prior, has_form
from aoicell.calibration.problem import Sight
from aoicell.calibration.starts import sight_poses, start_estimate
from aoicell.transforms import Array

PLAIN = CalibrationConfig(lenses=("k1k2",), robots=("per_view",))
BOARD = cell().tabletarget.corners


def bent(recording: Recording, shape: Array, px: float, seed: int) -> Recording:
    """The recording with the board's points lifted by `shape` (M, 3)."""
    problem, rng = recording.problem, np.random.default_rng(seed)
    fixtures = tuple(replace(f, points=f.points + shape) for f in problem.fixtures)
    true = replace(problem, fixtures=fixtures)
    views = []
    for view, flange in zip(problem.views, recording.truth.flanges, strict=True):
        uv = recording.truth.sees(true, "hand", "tabletarget", flange)
        uv = uv + px * rng.standard_normal(uv.shape)
        views.append(replace(view, sights=(Sight("hand", "tabletarget", np.arange(len(uv)), uv),)))
    return replace(recording, problem=problem.with_views(views))


def bow(mm: float) -> Array:
    u, v = (BOARD[:, :2] / np.abs(BOARD[:, :2]).max(axis=0)).T
    return np.column_stack([0 * u, 0 * u, mm / 1e3 * (1 - u**2) * (1 - v**2)])


def test_heights_hold_no_plane_and_stretch_no_size() -> None:
    B = form_basis(BOARD)
    plane = np.column_stack([np.ones(len(BOARD)), BOARD[:, :2]])
    np.testing.assert_allclose(plane.T @ B[:, 2, :3], 0, atol=1e-12)
    np.testing.assert_allclose((BOARD * B[:, :, 3]).sum(axis=0)[:2] > 0, [True, False])
    np.testing.assert_allclose(form_basis(BOARD, BOARD[5:9]), B[5:9])
    assert np.ptp(B[:, 2, 0]) == pytest.approx(1 - 1 / 49)  # u = -1, -5/7, .. 1/7 ..


def test_only_grids_have_a_form_and_its_prior_can_be_given() -> None:
    assert has_form(BOARD)
    assert not has_form(BOARD[:4])
    assert not has_form(np.column_stack([np.arange(12.0), np.zeros(12), np.zeros(12)]))
    half = np.ptp(BOARD[:, 0]) / 2
    np.testing.assert_allclose(form_prior(BOARD, 1e-3, None), [2e-3 * half] * 3 + [1e-3])
    np.testing.assert_allclose(form_prior(BOARD, 1e-4, 1e-5), [1e-5] * 3 + [1e-4])


def test_derivatives_by_the_form() -> None:
    recording = draw_recording(2, Conditions(views=4))
    problem, model = recording.problem, Model()
    posed = sight_poses(problem)
    estimate = conform(problem, model, start_estimate(problem, posed.poses, 1.0).estimate)
    layout = layout_of(problem, model)
    where = layout.blocks["form", "tabletarget"]
    estimate = replace(
        estimate, forms={"tabletarget": np.array([1e-4, -2e-4, 3e-4, 1e-3])},
        scales={"tabletarget": 1.01},
    )  # fmt: skip
    J = linearise(problem, layout, estimate).J[:, where]
    for k in range(4):
        step = 1e-6 * np.eye(layout.size)[where.start + k]
        ahead, behind = (
            linearise(problem, layout, retract(layout, estimate, s, estimate.deviations), False)
            for s in (step, -step)
        )
        np.testing.assert_allclose(
            J[:, k], (behind.residuals - ahead.residuals) / 2e-6, rtol=1e-5, atol=1e-2
        )


@pytest.mark.parametrize("seed", range(3))
def test_a_bent_board_does_not_mislead(seed: int) -> None:
    """0.3 mm of bow: taken for flat it costs 20 px of focal length and 2 % of the board's size."""
    conditions = Conditions(views=12, repeat_mm=0.02, repeat_deg=0.003)
    recording = bent(draw_recording(seed, conditions), bow(0.3), 0.05, seed)
    report = calibrate(recording.problem, PLAIN)
    assert report.verdict == "ok", report.reasons
    assert report.solution is not None
    assert report.uncertainty is not None
    focal = report.solution.estimate.cameras["hand"].focal_px
    true = recording.truth.cameras["hand"].focal_px
    index = report.solution.layout.blocks["intrinsics", "hand"].start
    assert abs(focal - true) < 4 * report.uncertainty.std[index] < 15
    (size,) = report.sizes
    assert size.factor == pytest.approx(1, abs=4 * size.std)
    form = report.solution.estimate.form("tabletarget")
    assert -3.3e-4 < form[0] < -1e-4  # the middle stands out: curved downwards both ways
    assert -3.3e-4 < form[1] < -1e-4
    assert abs(form[2]) < 5e-5


def test_a_board_declared_flat_is_taken_at_its_word() -> None:
    recording = bent(draw_recording(0, Conditions(views=12)), bow(0.3), 0.05, 0)
    fixture = replace(recording.problem.fixtures[0], flatness_std=1e-7, size_std=1e-7)
    report = calibrate(replace(recording.problem, fixtures=(fixture,)), PLAIN)
    assert (
        report.solution is None
        or np.abs(report.solution.estimate.form("tabletarget")[:3]).max() < 1e-5
    )
