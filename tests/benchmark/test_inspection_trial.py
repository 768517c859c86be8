"""A trial that inspects: the same board for every method, scored from what was planted."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from aoicell.benchmark.inspection_trial import draw_population, is_tolerated
from aoicell.benchmark.records import InspectionRecord, TrialRecord
from aoicell.benchmark.trial import Session, prepare, run_trial
from aoicell.nominal import Nominal
from aoicell.online import Ts_camera_board
from aoicell.scenario import Scenario
from aoicell.sim.defects import Defect
from aoicell.transforms import distance_deg, distance_mm

SCENARIO = Scenario(
    name="two_boards", profile="typical", methods=["uncorrected", "aoicell_one_look"], seed=3,
    trials_per_world=2, inspect=True,
)  # fmt: skip


@pytest.fixture(scope="module")
def session(nominal: Nominal) -> Iterator[Session]:
    two_views = replace(nominal, inspection_views=nominal.inspection_views[:2])
    session = prepare(SCENARIO, two_views, 0)
    yield session
    session.world.close()


@pytest.fixture(scope="module")
def records(session: Session) -> list[TrialRecord]:
    return [result.record for result in run_trial(session, 0)]


@pytest.fixture(scope="module")
def inspected(records: list[TrialRecord]) -> dict[str, InspectionRecord]:
    found = {record.method: record.inspection for record in records}
    return {method: record for method, record in found.items() if record is not None}


def test_uncorrected_means_that_nothing_is_corrected(records: list[TrialRecord]) -> None:
    shift = {record.method: record.measured_shift_mm for record in records}
    assert shift["uncorrected"] == pytest.approx(0, abs=1e-6)
    assert shift["aoicell_one_look"] > 10


def test_each_method_inspects_the_same_board(inspected: dict[str, InspectionRecord]) -> None:
    one, other = inspected.values()
    planted = [{p.component: p.planted for p in i.parts if p.planted} for i in (one, other)]
    assert planted[0] == planted[1]
    assert len(planted[0]) >= 3
    assert one.unseen == other.unseen


def test_a_board_that_was_not_corrected_gets_no_verdict(
    inspected: dict[str, InspectionRecord],
) -> None:
    board = inspected["uncorrected"]
    assert board.verdict == "no_verdict"
    assert {r.state for r in board.registrations} == {"no_verdict"}
    assert not any(part.called for part in board.parts)


def test_a_corrected_board_is_judged(inspected: dict[str, InspectionRecord]) -> None:
    board = inspected["aoicell_one_look"]
    assert board.verdict == "fail"
    assert {r.state for r in board.registrations} == {"registered"}
    assert all(r.error_px is not None and r.error_px < 0.5 for r in board.registrations)
    defects = [part for part in board.parts if part.planted and not part.tolerated]
    assert sum(part.called for part in defects) >= 0.8 * len(defects)
    assert sum(part.called and not part.planted for part in board.parts) <= 2


def test_the_references_show_the_board_where_it_lies(session: Session) -> None:
    """Also to the method that knows one marker only."""
    for method in SCENARIO.methods:
        for view in session.taught.views:
            estimate = Ts_camera_board(session.online(method))[view.id]
            truth = session.world.truth_of(view.standard).T_camera_board
            assert distance_mm(estimate, truth) < 15
            assert distance_deg(estimate, truth) < 1.5


def test_boards_differ_by_trial_and_repeat_by_seed(session: Session) -> None:
    first, again, other = (draw_population(SCENARIO, session.world, k) for k in (0, 0, 1))
    assert first.defects == again.defects
    assert first.board.components == again.board.components
    assert first.defects != other.defects
    fewer = SCENARIO.model_copy(
        update={"inspection": SCENARIO.inspection.model_copy(update={"kinds": ["missing"]})}
    )
    assert {d.kind for d in draw_population(fewer, session.world, 0).defects} == {"missing"}


def test_what_the_class_allows_is_tolerated(nominal: Nominal) -> None:
    board = nominal.board
    component = next(c for c in board.components if c.kind == "chip")
    allowed = board.tolerance(component)
    near, far = 0.99 * allowed.shift, 1.01 * allowed.shift
    for shift, tolerated in ((near, True), (far, False)):
        for angle in np.linspace(0, 2 * np.pi, 7):
            way = (float(shift * np.cos(angle)), float(shift * np.sin(angle)))
            defect = Defect("shifted", component.id, way)
            assert is_tolerated(defect, component, board) is tolerated
    for turn, tolerated in ((0.99, True), (1.01, False)):
        for sign in (1, -1):
            defect = Defect("rotated", component.id, rotation=sign * turn * allowed.rotation)
            assert is_tolerated(defect, component, board) is tolerated
    assert not is_tolerated(Defect("missing", component.id), component, board)
