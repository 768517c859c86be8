"""Stated errors hold: what is predicted at unused poses lies in its interval as often as said."""

import numpy as np
import pytest
from helpers.recorded import Conditions, Recording, cell, draw_recording
from scipy.stats import binom

from aoicell.calibration.bundle import Solution
from aoicell.calibration.measurement import shaped_points
from aoicell.calibration.observability import Freedom
from aoicell.calibration.parameters import Model, RobotModel
from aoicell.calibration.prediction import predict
from aoicell.calibration.problem import CalibrationView
from aoicell.calibration.selection import fit, select
from aoicell.calibration.starts import sight_poses, start_estimate
from aoicell.calibration.uncertainty import uncertainty_of
from aoicell.errors import InputError
from aoicell.transforms import apply, from_xyz_rpy

CELLS = (
    Conditions(views=10),
    Conditions(views=10, repeat_mm=0.02, repeat_deg=0.003),
    Conditions(views=15, repeat_mm=0.02, repeat_deg=0.003),
    Conditions(views=12, repeat_mm=0.017, repeat_deg=0.003, joint_deg=0.02, origin_mm=0.2),
)


def solve(recording: Recording, model: Model | None = None) -> Solution:
    posed = sight_poses(recording.problem)
    start = start_estimate(posed.problem, posed.poses, posed.rms_px)
    if model is not None:
        return fit(posed.problem, model, start.estimate, start.noise)
    return select(posed.problem, start.estimate, start.noise)[0].solution


def hits(recording: Recording, model: Model | None) -> tuple[int, int]:
    """Coordinates of predicted points in their 95 % interval, and all; None chooses the model."""
    solution = solve(recording, model)
    uncertainty = uncertainty_of(solution)
    problem, truth = recording.problem, recording.truth
    corners = [0, 7, 40, 47]
    points = problem.fixture("tabletarget").points[corners]
    inside = total = 0
    for q in recording.unused_q[:5]:
        view = CalibrationView("unused", cell().arm.fk(q), (), q)
        found = predict(solution, uncertainty, "hand", view, points, "tabletarget")
        true = truth.sees(problem, "hand", "tabletarget", truth.arm.fk(q))[corners]
        std = np.sqrt(np.diagonal(found.cov_px, axis1=1, axis2=2))
        within = np.abs(found.uv_px - true) < 1.96 * std
        inside, total = inside + int(within.sum()), total + within.size
    return inside, total


def coverage(seeds: range, choosing: bool) -> float:
    counts = []
    for seed in seeds:
        conditions = CELLS[seed % len(CELLS)]
        robot: RobotModel = "joint_terms" if conditions.joint_deg else "per_view"
        model = None if choosing else Model("k1k2p1p2", robot)
        counts.append(hits(draw_recording(seed, conditions), model))
    inside, total = np.sum(counts, axis=0)
    return float(inside / total)


def test_intervals_contain_the_truth_as_often_as_they_say() -> None:
    # the forty coordinates of a cell share its errors: count them as four
    trials = 4 * 8
    low = binom.ppf(1e-3, trials, 0.94) / trials
    assert low <= coverage(range(8), choosing=False)


@pytest.mark.slow
def test_intervals_contain_the_truth_90_to_98_times_in_100() -> None:
    assert 0.90 <= coverage(range(200), choosing=True) <= 0.98


def test_the_arms_freedoms_are_named_and_nothing_else() -> None:
    recording = draw_recording(0, CELLS[3])
    solution = solve(recording, Model(robot="joint_terms"))
    sentences = [f.sentence for f in uncertainty_of(solution).unobservable]
    assert "joint_1 offset cannot be told from T_base_tabletarget" in sentences
    assert "joint_6 offset cannot be told from T_flange_hand" in sentences
    assert "joint_6 origin y cannot be told from T_flange_hand" in sentences
    assert all(f.held for f in uncertainty_of(solution).unobservable)
    assert not uncertainty_of(solve(recording, Model())).unobservable


def test_a_size_that_nothing_tells_has_no_number() -> None:
    # the tripod and the table do not move: nothing measures the table's board by the arm
    recording = draw_recording(5, Conditions(views=14, boards=("tripod",), tilt_deg=15))
    model = Model("k1k2", "exact", ("tabletarget", "armtarget"))
    solution = solve(recording, model)
    uncertainty = uncertainty_of(solution)
    std = dict(zip(uncertainty.names, uncertainty.std, strict=True))
    assert np.isnan(std["tabletarget scale"])
    assert std["armtarget scale"] < 1e-2
    (freedom,) = uncertainty.unobservable
    assert not freedom.held
    assert any(name.startswith("T_base_tabletarget") for name in freedom.parameters)


def test_what_the_prior_holds_is_told() -> None:
    uncertainty = uncertainty_of(solve(draw_recording(0, CELLS[3]), Model(robot="joint_terms")))
    share = dict(zip(uncertainty.names, uncertainty.from_prior, strict=True))
    assert share["joint_1 offset"] > 0.99
    assert share["T_flange_hand x"] == 0
    assert 0 < share["joint_4 offset"] < 0.8


def test_views_that_differ_more_than_the_model_says_widen_it() -> None:
    conditions = Conditions(views=15, repeat_mm=0.1, repeat_deg=0.02)
    recording = draw_recording(1, conditions)
    honest = uncertainty_of(solve(recording, Model(robot="per_view")))
    naive = uncertainty_of(solve(recording, Model(robot="exact")))
    assert honest.inflation < 1.6
    assert naive.inflation > 2


def test_an_arrival_adds_the_arms_deviation() -> None:
    recording = draw_recording(2, CELLS[2])
    solution = solve(recording, Model())
    uncertainty = uncertainty_of(solution)
    at, points = recording.problem.views[0].T_base_flange, np.zeros((1, 3))
    still = predict(solution, uncertainty, "hand", at, points, "tabletarget")
    arriving = predict(solution, uncertainty, "hand", at, points, "tabletarget", arrival=True)
    added_mm = np.sqrt(arriving.std_mm**2 - still.std_mm**2)
    assert 0.02 < added_mm[0] < 0.2  # 0.02 mm an axis, and 0.003 deg over 0.5 m
    assert arriving.std_px[0] > still.std_px[0]


def test_points_of_the_base_are_predicted_by_the_mount_alone() -> None:
    recording = draw_recording(2, CELLS[2])
    solution = solve(recording, Model())
    uncertainty = uncertainty_of(solution)
    at = recording.problem.views[0].T_base_flange
    Z = solution.estimate.T_mount_fixture["tabletarget"]
    estimate = solution.estimate
    points = recording.problem.fixture("tabletarget").points[:3]
    printed = estimate.scales["tabletarget"] * shaped_points(
        recording.problem, estimate, "tabletarget"
    )
    on_board = predict(solution, uncertainty, "hand", at, points, "tabletarget")
    in_base = predict(solution, uncertainty, "hand", at, apply(Z, printed[:3]))
    np.testing.assert_allclose(in_base.uv_px, on_board.uv_px, atol=1e-6)
    assert (in_base.std_px > on_board.std_px).all()  # the board was seen, the base was not


def test_joint_terms_need_the_joint_angles() -> None:
    solution = solve(draw_recording(0, CELLS[3]), Model(robot="joint_terms"))
    with pytest.raises(InputError, match="joint angles"):
        predict(solution, uncertainty_of(solution), "hand", from_xyz_rpy([0, 1, 1], [0, 0, 0]),
                np.zeros((1, 3)))  # fmt: skip


def test_a_freedom_reads_as_a_sentence() -> None:
    lone = Freedom(("table scale",), held=False)
    assert lone.sentence == "table scale: nothing that was seen depends on it"
