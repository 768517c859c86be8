"""Models are chosen by what they predict, not by what they leave."""

from dataclasses import replace

import numpy as np
from helpers.recorded import Conditions, Recording, cell, draw_recording, prediction_gaps

from aoicell.calibration.bundle import Solution
from aoicell.calibration.parameters import Model
from aoicell.calibration.prediction import predict
from aoicell.calibration.problem import CalibrationView
from aoicell.calibration.selection import (
    Candidate,
    HeldOut,
    better,
    closer,
    fit,
    hold_out,
    select,
)
from aoicell.calibration.starts import sight_poses, start_estimate
from aoicell.calibration.uncertainty import uncertainty_of

REAL = Conditions(views=12, repeat_mm=0.017, repeat_deg=0.003)


def choose(recording: Recording) -> tuple[Candidate, list[Candidate]]:
    posed = sight_poses(recording.problem)
    start = start_estimate(posed.problem, posed.poses, posed.rms_px)
    return select(posed.problem, start.estimate, start.noise)


def unseen_px(recording: Recording, solution: Solution) -> float:
    """Root mean square of the prediction at unused poses against the truth."""
    uncertainty = uncertainty_of(solution)
    points = recording.problem.fixture("tabletarget").points
    views = [CalibrationView("u", cell().arm.fk(q), (), q) for q in recording.unused_q]
    uvs = [predict(solution, uncertainty, "hand", v, points, "tabletarget").uv_px for v in views]
    gaps = prediction_gaps(recording, uvs, "hand", "tabletarget")
    return float(np.sqrt((gaps**2).sum(axis=-1).mean()))


def test_joint_terms_are_chosen_for_an_inexact_arm_and_pay() -> None:
    recording = draw_recording(1, replace(REAL, joint_deg=0.05, origin_mm=0.4))
    best, tried = choose(recording)
    assert best.model.robot == "joint_terms"
    per_view = next(c for c in tried if c.model.robot == "per_view")
    assert unseen_px(recording, best.solution) < 0.4 * unseen_px(recording, per_view.solution)


def test_a_lower_residual_does_not_decide() -> None:
    recording = draw_recording(0, replace(REAL, distortion=(0.0,) * 5, views=9))
    best, tried = choose(recording)
    richest = next(c for c in tried if c.model.lens == "k1k2p1p2k3")
    assert richest.solution.noise.sigma <= best.solution.noise.sigma * 1.001
    assert best.model.lens in ("none", "k1k2")


def test_a_bent_lens_is_seen_through_the_arms_deviations() -> None:
    recording = draw_recording(3, replace(REAL, repeat_mm=0.1, repeat_deg=0.02))
    best, _ = choose(recording)
    assert best.model.lens != "none"  # though by px alone it may predict as well


def test_supplied_intrinsics_stay() -> None:
    recording = draw_recording(2, replace(REAL, refine=False))
    best, tried = choose(recording)
    assert {c.model.lens for c in tried} == {"none"}
    camera = recording.problem.eyes[0].camera
    assert best.solution.estimate.cameras["hand"] is camera


def test_one_step_holds_out_like_a_refit() -> None:
    recording = draw_recording(4, REAL)
    posed = sight_poses(recording.problem)
    start = start_estimate(posed.problem, posed.poses, posed.rms_px)
    solution = fit(posed.problem, Model(), start.estimate, start.noise)
    step, refit = hold_out(solution), hold_out(solution, refit=True)
    np.testing.assert_allclose(step.px, refit.px, rtol=0.1)
    np.testing.assert_allclose(step.mm, refit.mm, rtol=0.1)
    left = np.sqrt(2 * (solution.lin.residuals**2).mean())
    assert np.median(refit.px) > 1.5 * left  # not the residual


def held(px: list[float], score: list[float]) -> HeldOut:
    return HeldOut(np.array(px), np.array(px), np.array(score))


def test_a_gain_has_to_exceed_its_own_scatter() -> None:
    every = np.ones(4, dtype=bool)
    simple = held([1, 1, 1, 1], [0, 0, 0, 0])
    assert closer(held([0.5, 0.5, 0.5, 0.6], [0] * 4), simple, every)
    assert not closer(held([0.2, 1.4, 1.4, 1.4], [0] * 4), simple, every)
    assert better(held([1] * 4, [3, 2, 3, 4]), simple, every)
    assert not better(held([1] * 4, [9, -3, -2, -2]), simple, every)
    assert better(held([1] * 4, [9, -3, -2, -2]), simple, every, sure=0)
    two_left = np.array([True, True, False, True])
    assert not better(held([1] * 4, [3, 2, 3, -np.inf]), simple, two_left)
