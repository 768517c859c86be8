"""Trials: the acceptance of the exact cell, determinism, and what is refused."""

import copy
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from helpers.running import Run
from hypothesis import given
from hypothesis import strategies as st

from aoicell.benchmark.displacement import draw_displacement
from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.scoring import residual_vectors, visible_points
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.trial import Session, TrialResult, run_trial
from aoicell.online import look, relocate
from aoicell.pipeline import METHODS
from aoicell.scenario import Displacement
from aoicell.sim.world import Truth
from aoicell.transforms import SE3, angle_of

pytest_plugins = ["helpers.sessions"]

MM, PX = 0.05, 0.3  # what an exact cell has to keep within
TRIALS = 20


def with_displacement(session: Session, trials: int = 1, **changes: Any) -> Session:
    """The same cell with other displacements."""
    scenario = session.scenario.model_copy(
        update={"displacement": Displacement(**changes), "trials_per_world": trials}
    )
    return replace(session, scenario=scenario)


def drawn(session: Session, trial: int) -> SE3:
    """The board's motion in a trial."""
    return draw_displacement(session.scenario, session.world, session.T_base_board_taught, trial)


# -- The exact cell ----------------------------------------------------------


def true_residuals(session: Session, trial: int, method: str) -> tuple[list[float], list[float]]:
    """mm and px of each view from truth, as the records have them, without new pictures."""
    world, template = session.world, session.templates[method]
    motion = drawn(session, trial)
    world.place_board(motion * session.T_base_board_taught)
    world.begin(trial)
    online = session.online(method)
    correction = relocate(look(session.cell, online), online)
    mm, px = [], []
    camera, marker = world.geometry.cameras["hand"], session.nominal.marker
    for taught, view in zip(template.views, correction.views, strict=True):
        before: Truth = world.truth_of(taught.standard)
        world.arrive(view.q)
        after = world.truth()
        vectors = residual_vectors(
            before.T_camera_board, after.T_camera_board, visible_points(world, before)
        )
        mm.append(1e3 * float(np.linalg.norm(vectors, axis=1).mean()))
        for id in world.geometry.Ts_board_marker:
            if camera.sees(world.marker_points(id, marker.outline), before.T_camera_board):
                crosses = world.marker_points(id, marker.crosses)
                uv = [camera.project(crosses, t.T_camera_board) for t in (before, after)]
                px.append(float(np.linalg.norm(uv[1] - uv[0], axis=1).mean()))
    world.place_board(session.T_base_board_taught)
    return mm, px


@pytest.mark.parametrize(
    "trials", [range(6), pytest.param(range(6, TRIALS), marks=pytest.mark.slow)], ids=str
)
@pytest.mark.parametrize("method", ["paper", "aoicell_one_look", "aoicell"])
def test_an_exact_cell_is_corrected_exactly(
    ideal_session: Session, method: str, trials: range
) -> None:
    results = [true_residuals(ideal_session, trial, method) for trial in trials]
    mm, px = ([np.mean(values) for values in column] for column in zip(*results, strict=True))
    assert np.mean(mm) <= MM
    assert np.mean(px) <= PX


@pytest.fixture(scope="module", params=[0, pytest.param(1, marks=pytest.mark.slow)])
def detected(request: pytest.FixtureRequest, ideal_session: Session) -> list[TrialResult]:
    """One of those trials with all pictures."""
    return run_trial(ideal_session, request.param)


def test_and_so_it_looks_in_the_pictures(
    ideal_session: Session, detected: list[TrialResult]
) -> None:
    for record in (result.record for result in detected):
        assert record.outcome == "corrected"
        assert record.reason == ""
        markers = [marker for view in record.views for marker in view.markers]
        assert len(markers) >= 4
        for marker in markers:
            assert marker.detected_px is not None
            assert marker.detected_px == pytest.approx(marker.true_px, abs=0.05)
        assert np.mean([m.detected_px for m in markers]) <= PX
        if METHODS[record.method].looks > 1:
            continue  # its last pictures are of another correction
        mm, px = true_residuals(ideal_session, record.trial, record.method)
        np.testing.assert_allclose([view.residual_mm for view in record.views], mm, atol=1e-9)
        np.testing.assert_allclose([m.true_px for m in markers], px, atol=1e-9)


def test_a_trial_says_how_the_board_was_moved(
    ideal_session: Session, detected: list[TrialResult]
) -> None:
    for result in detected:
        record = result.record
        taught, now = (np.array(T) for T in (record.T_base_board_taught, record.T_base_board_now))
        marker = np.append(ideal_session.nominal.T_board_positioning.translation, 1)
        moved = (now @ marker - taught @ marker)[:3]
        assert 1e3 * np.linalg.norm(moved) == pytest.approx(record.displacement_mm, abs=1e-9)
        turn = SE3(now[:3, :3] @ taught[:3, :3].T, np.zeros(3))
        assert np.degrees(angle_of(turn)) == pytest.approx(record.turn_deg, abs=1e-9)
        if record.method == "paper":  # whose located frame is the marker itself
            assert record.measured_shift_mm == pytest.approx(record.displacement_mm, abs=0.2)
        assert record.correction_seconds is not None
        assert 0 < record.correction_seconds < 5


def test_the_board_is_back_in_place_after_a_trial(
    ideal_session: Session, detected: list[TrialResult]
) -> None:
    assert ideal_session.world.T_base_board == ideal_session.T_base_board_taught


# -- Displacements ----------------------------------------------------------


@given(
    trial=st.integers(0, 30),
    mm=st.tuples(st.floats(0, 60), st.floats(0, 60)).map(sorted),
    deg=st.tuples(st.floats(-15, 15), st.floats(-15, 15)).map(sorted),
)
def test_displacements_are_drawn_within_their_ranges(
    ideal_session: Session, trial: int, mm: list[float], deg: list[float]
) -> None:
    session = with_displacement(
        ideal_session,
        shift_mm={"min": mm[0], "max": mm[1]},
        turn_deg={"min": deg[0], "max": deg[1]},
    )
    motion = drawn(session, trial)
    T = ideal_session.T_base_board_taught * ideal_session.nominal.T_board_positioning
    moved = 1e3 * (motion.act(T.translation) - T.translation)
    assert mm[0] - 1e-9 <= np.linalg.norm(moved) <= mm[1] + 1e-9
    assert moved[2] == pytest.approx(0, abs=1e-9)
    turn = np.degrees(np.arctan2(motion.rotation[1, 0], motion.rotation[0, 0]))
    assert deg[0] - 1e-9 <= turn <= deg[1] + 1e-9
    assert motion.rotation[2, 2] == pytest.approx(1, abs=1e-12)


def test_lift_and_tilt_lead_out_of_the_plane(ideal_session: Session) -> None:
    session = with_displacement(
        ideal_session,
        trials=3,
        shift_mm=[10.0, 20.0, 30.0],
        turn_deg={"min": 0, "max": 0},
        lift_mm={"min": 4, "max": 4},
        tilt_deg={"min": 3, "max": 3},
    )
    T = ideal_session.T_base_board_taught * ideal_session.nominal.T_board_positioning
    for trial, shift in enumerate((10, 20, 30)):
        motion = drawn(session, trial)
        moved = 1e3 * (motion.act(T.translation) - T.translation)
        assert moved[2] == pytest.approx(4)
        assert np.linalg.norm(moved) == pytest.approx(shift)
        assert np.degrees(np.arccos(motion.rotation[2, 2])) == pytest.approx(3)


def test_directions_differ_from_trial_to_trial(ideal_session: Session) -> None:
    motions = [drawn(ideal_session, k) for k in range(TRIALS)]
    T = ideal_session.T_base_board_taught * ideal_session.nominal.T_board_positioning
    moved = np.array([m.act(T.translation) - T.translation for m in motions])
    quadrants = {(x > 0, y > 0) for x, y, _ in moved}
    assert len(quadrants) == 4
    turns = [np.arctan2(m.rotation[1, 0], m.rotation[0, 0]) for m in motions]
    assert min(turns) < 0 < max(turns)


# -- Determinism ----------------------------------------------------------


def numbers(record: TrialRecord) -> dict[str, Any]:
    """All that is a result, and no time."""
    return {k: v for k, v in asdict(record).items() if k != "correction_seconds"}


@pytest.fixture(scope="module")
def paper_trial(paper_session: Session) -> dict[str, TrialRecord]:
    return {r.record.method: r.record for r in run_trial(paper_session, 0)}


def test_the_same_scenario_gives_the_same_numbers_bit_for_bit(
    demo: Run, paper_trial: dict[str, TrialRecord], paper_session: Session
) -> None:
    """The demo ran the same world by itself, its methods in the other order."""
    assert demo.code == 0, demo.stderr
    assert paper_session.scenario.methods == ["aoicell", "aoicell_one_look", "paper"]
    first = {t.method: t for t in RunStore(demo.folder).trials() if t.trial == 0}
    assert set(first) == set(paper_trial)
    for method, record in paper_trial.items():
        assert numbers(record) == numbers(first[method])


def test_leaving_a_method_out_changes_nothing_for_the_other(
    paper_session: Session, paper_trial: dict[str, TrialRecord]
) -> None:
    alone = replace(paper_session, methods={"paper": paper_session.methods["paper"]})
    (result,) = run_trial(alone, 0)
    assert numbers(result.record) == numbers(paper_trial["paper"])


def test_in_the_papers_cell_the_better_method_is_better(
    paper_trial: dict[str, TrialRecord],
) -> None:
    mean = {m: np.mean([v.residual_mm for v in r.views]) for m, r in paper_trial.items()}
    assert mean["aoicell"] < min(1.0, mean["paper"])


# -- Refused ----------------------------------------------------------


def test_a_marker_out_of_view_is_refused_by_name(ideal_session: Session) -> None:
    session = with_displacement(ideal_session, trials=2, shift_mm=[250.0, 250.0])
    # markerless sees enough of the board without its markers
    by_markers = {n: m for n, m in session.methods.items() if n != "markerless"}
    results = run_trial(replace(session, methods=by_markers), 0)
    assert len(results) == len(by_markers) > 0
    for result in results:
        record = result.record
        assert record.outcome == "refused"
        assert "missing: " in record.reason
        assert "M1" in record.reason
        assert "bring the board back into view" in record.reason
        assert record.cause == "marker_not_found"
        assert record.views == []
        assert result.images == {}
        assert record.measured_shift_mm is None
        assert record.displacement_mm == pytest.approx(250)
    assert session.world.T_base_board == session.T_base_board_taught


@pytest.fixture
def stiff_session(ideal_session: Session) -> Session:
    """An arm whose joints hardly leave the first taught view."""
    q = ideal_session.taught.views[0].standard.state.q
    calibrations = {}
    for name, calibration in ideal_session.calibrations.items():
        arm = copy.copy(calibration.arm)
        arm.lower, arm.upper = q - 1e-3, q + 1e-3
        calibrations[name] = replace(calibration, arm=arm)
    return replace(ideal_session, calibrations=calibrations)


def test_a_corrected_view_out_of_reach_is_refused_by_name(stiff_session: Session) -> None:
    for result in run_trial(stiff_session, 3):
        assert result.record.outcome == "refused"
        assert result.record.reason.startswith("corrected view V1: flange pose at (")
        assert "is out of reach" in result.record.reason
        assert result.record.views == []
