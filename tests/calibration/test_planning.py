"""Planned poses: what they promise, against fits to simulated detections with known noise."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.calibration.bundle import Noise, refine
from aoicell.calibration.candidates import CandidateConfig, candidates, collision_model, free_path
from aoicell.calibration.candidates import hand_eye_start as start_of
from aoicell.calibration.parameters import Estimate, Model, conform, layout_of
from aoicell.calibration.planning import (
    PlanningConfig,
    PosePlan,
    WorkView,
    inspection_work,
    plan_poses,
)
from aoicell.calibration.poses import TABLE_2
from aoicell.calibration.prediction import predict
from aoicell.calibration.problem import CalibrationView, Eye, Fixture, Problem, Sight
from aoicell.calibration.uncertainty import uncertainty_of
from aoicell.errors import Unreachable
from aoicell.nominal import Nominal
from aoicell.transforms import Array, apply

CONFIG = PlanningConfig(count=8, candidates=60)


@pytest.fixture(scope="module")
def work(nominal: Nominal) -> list[WorkView]:
    corners = apply(nominal.T_base_tabletarget, nominal.tabletarget.corners)
    looks = candidates(nominal, 6, np.random.default_rng(9), CandidateConfig())
    return [WorkView(q, corners) for q in looks]


@pytest.fixture(scope="module")
def plan(nominal: Nominal, work: list[WorkView]) -> PosePlan:
    return plan_poses(nominal, CONFIG, work)


def table_2(nominal: Nominal) -> list[Array]:
    q_start = start_of(nominal)
    T_start = nominal.arm.fk(q_start)
    return [nominal.arm.ik(T_start * dT, q_start) for dT in TABLE_2.values()]


def test_each_pose_shrinks_the_predicted_error(plan: PosePlan) -> None:
    px = [pose.predicted_px for pose in plan.poses]
    mm = [pose.predicted_mm for pose in plan.poses]
    assert len(px) == 8
    assert (np.diff(px) < 0).all()
    assert (np.diff(mm) < 0).all()
    assert px[-1] < 1
    # at 0.35 to 0.65 m and 2667 px a pixel is 0.13 to 0.24 mm
    assert 0.13 < mm[-1] / px[-1] < 0.24


def test_each_pose_can_be_driven_to_from_the_one_before(nominal: Nominal, plan: PosePlan) -> None:
    cell, at = collision_model(nominal, CONFIG.usable.clearance_mm / 1e3), start_of(nominal)
    for q in plan.qs:
        assert free_path(cell, at, q)
        at = q


def test_a_way_that_is_blocked_is_not_taken(
    nominal: Nominal, work: list[WorkView], plan: PosePlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = plan.qs[0]
    monkeypatch.setattr(
        "aoicell.calibration.planning.free_path", lambda cell, a, b: not np.array_equal(b, blocked)
    )
    other = plan_poses(nominal, CONFIG, work)
    assert not any(np.array_equal(q, blocked) for q in other.qs)
    monkeypatch.setattr("aoicell.calibration.planning.free_path", lambda *_: False)
    with pytest.raises(Unreachable, match="after 0 of 8 no other candidate"):
        plan_poses(nominal, CONFIG, work)


def test_the_same_seed_plans_the_same(
    nominal: Nominal, work: list[WorkView], plan: PosePlan
) -> None:
    again = plan_poses(nominal, CONFIG, work)
    np.testing.assert_array_equal(again.qs, plan.qs)
    assert [p.predicted_px for p in again.poses] == [p.predicted_px for p in plan.poses]
    other = plan_poses(nominal, replace(CONFIG, seed=1), work)
    assert not np.array_equal(other.qs, plan.qs)


def test_the_next_best_poses_go_on_from_what_was_taken(
    nominal: Nominal, work: list[WorkView], plan: PosePlan
) -> None:
    rest = plan_poses(nominal, replace(CONFIG, count=3), work, taken=plan.qs[:5])
    assert rest.taken_px == pytest.approx(plan.poses[4].predicted_px)
    assert rest.taken_mm == pytest.approx(plan.poses[4].predicted_mm)
    assert rest.poses[0].predicted_px < rest.taken_px
    assert np.isnan(plan.taken_px)


def test_six_planned_poses_are_better_than_the_papers_six(nominal: Nominal) -> None:
    planned = plan_poses(nominal, replace(CONFIG, count=6))
    papers = plan_poses(nominal, replace(CONFIG, count=0), taken=table_2(nominal))
    assert planned.poses[-1].predicted_px < 0.8 * papers.taken_px
    assert planned.poses[-1].predicted_mm < 0.8 * papers.taken_mm


def test_the_work_is_what_the_inspection_views_show(nominal: Nominal) -> None:
    views = inspection_work(nominal)
    assert len(views) == len(nominal.inspection_views)
    for view in views:
        T = nominal.T_flange_camera.inverse() * nominal.arm.fk(view.q).inverse()
        assert len(view.points) > 5
        for point in view.points:
            assert nominal.cameras["hand"].sees([point], T)


def test_the_prediction_is_that_of_the_refinement_itself(
    nominal: Nominal, work: list[WorkView], plan: PosePlan
) -> None:
    """Plan, take exactly designed pictures, refine, and ask the fit for its own covariance."""
    board, camera, prior = nominal.tabletarget, nominal.cameras["hand"], CONFIG.prior
    every = np.arange(len(board.corners))
    views = []
    for k, q in enumerate(plan.qs):
        T = nominal.arm.fk(q)
        T_camera_board = (T * nominal.T_flange_camera).actInv(nominal.T_base_tabletarget)
        uv = camera.project(board.corners, T_camera_board)
        views.append(CalibrationView(f"{k}", T, (Sight("hand", "board", every, uv),), q))
    problem = Problem(
        (Eye("hand", camera, "flange"),),
        (Fixture("board", board.corners),), tuple(views), nominal.arm,
    )  # fmt: skip
    model = Model(robot="joint_terms")
    layout = layout_of(problem, model, prior)
    estimate = Estimate(
        {"hand": nominal.T_flange_camera}, {"board": nominal.T_base_tabletarget},
        {"hand": camera}, {"board": 1.0}, np.zeros((len(views), 6)),
    )  # fmt: skip
    noise = Noise(CONFIG.sigma_px, prior.deviation_mm / 1e3, np.radians(prior.deviation_deg))
    solution = refine(problem, layout, conform(problem, model, estimate), noise)
    uncertainty = uncertainty_of(solution)
    T_board_base = nominal.T_base_tabletarget.inverse()
    variances = []
    for view in work:
        at = CalibrationView("work", nominal.arm.fk(view.q), (), view.q)
        seen = predict(
            solution, uncertainty, "hand", at, apply(T_board_base, view.points), on="board"
        )
        variances.append(np.trace(seen.cov_px, axis1=1, axis2=2))
    rms = float(np.sqrt(np.mean(variances))) / uncertainty.inflation
    # the plan's points are exact; the fit's own are as uncertain as the print's form
    assert plan.poses[-1].predicted_px == pytest.approx(rms, rel=0.1)
