"""Localisation when something goes wrong: a seeded part of the study of adverse trials."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, replace

import pytest

from aoicell import online
from aoicell.benchmark.localisation_trial import injected_cause, run_localisation_trial
from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.refusals import by_cause, silent_wrong
from aoicell.benchmark.trial import Session, prepare
from aoicell.first_look import expected_leftover
from aoicell.nominal import Nominal
from aoicell.resources import find
from aoicell.scenario import load_scenario
from aoicell.sim.adversity import CAUSES


@pytest.fixture(scope="module")
def session(nominal: Nominal) -> Iterator[Session]:
    scenario = load_scenario(find("scenarios", "adverse_localisation"))
    session = prepare(scenario, nominal, 3)
    yield session
    session.world.close()


@pytest.fixture(scope="module", params=[1, pytest.param(2, marks=pytest.mark.slow)])
def each(request: pytest.FixtureRequest) -> int:
    """How often every cause has its turn."""
    return int(request.param)


@pytest.fixture(scope="module")
def records(session: Session, each: int) -> list[TrialRecord]:
    trials = range(each * len(CAUSES))
    return [run_localisation_trial(session, trial)[0].record for trial in trials]


def test_every_cause_has_its_turn(records: list[TrialRecord], each: int) -> None:
    assert Counter(r.injected for r in records) == dict.fromkeys(CAUSES, each)


def test_nothing_is_silently_wrong(session: Session, records: list[TrialRecord]) -> None:
    tolerance_mm = session.scenario.tolerance_mm
    wrong = [r for r in records if r.outcome == "failed" or silent_wrong(r, tolerance_mm)]
    assert not wrong


def test_refusals_speak_of_what_went_wrong(
    session: Session, records: list[TrialRecord], each: int
) -> None:
    counts = by_cause(records, session.scenario.tolerance_mm)
    refused = sum(c["refused"] for c in counts.values())
    assert refused >= 5  # or there was nothing to match
    assert sum(c["matched"] for c in counts.values()) >= 0.95 * refused
    assert counts["none"]["corrected"] == each
    assert counts["moved_camera"]["reasons"] == {"contradicted": each}
    assert counts["blur"]["refused"] + counts["occlusion"]["refused"] >= 1


def test_a_trial_repeats_itself(session: Session, records: list[TrialRecord]) -> None:
    trial = next(r.trial for r in records if r.injected == "wrong_marker")
    [again] = run_localisation_trial(session, trial)
    timeless = [replace(r, correction_seconds=None) for r in (records[trial], again.record)]
    assert asdict(timeless[0]) == asdict(timeless[1])


def test_without_a_list_nothing_goes_wrong(session: Session) -> None:
    plain = replace(session, scenario=session.scenario.model_copy(update={"inject": []}))
    assert {injected_cause(plain, trial) for trial in range(5)} == {"none"}


def test_without_its_gate_a_knock_is_silently_wrong(
    session: Session, records: list[TrialRecord], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The count of silent errors is no idle zero."""
    monkeypatch.setattr(
        online, "expected_leftover", lambda *given: (expected_leftover(*given)[0], 1.0)
    )
    knocked = [r.trial for r in records if r.injected == "moved_camera"]
    again = [run_localisation_trial(session, trial)[0].record for trial in knocked]
    assert any(silent_wrong(r, session.scenario.tolerance_mm) for r in again)
