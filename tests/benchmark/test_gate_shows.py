"""The gate on real runs: a planted bias is found, unchanged runs with other seeds are not.

The long versions are slow: `pytest -m slow tests/benchmark/test_gate_shows.py`.
"""

from pathlib import Path

import pytest
from helpers.gate_runs import plant_bias, prepared, store_run

from aoicell.benchmark.gate import GateResult, check
from aoicell.benchmark.runner import run_scenario
from aoicell.benchmark.snapshot import Snapshot, snapshot
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.trial import Session
from aoicell.nominal import Nominal
from aoicell.scenario import Scenario

MM = 0.05
BY_ONE_LOOK = ["paper", "aoicell_one_look"]  # a second look takes such a bias out again
FIFTY = Scenario(name="fifty", worlds=10, trials_per_world=5, methods=BY_ONE_LOOK, pictures=False)
FEW = Scenario(
    name="few", worlds=1, trials_per_world=6, methods=["aoicell_one_look"], pictures=False
)


def planted(
    sessions: list[Session], baseline: Snapshot, axis: str, mm: float, folder: Path
) -> GateResult:
    """The same trials, with a bias along an axis of the camera in each corrected pose."""
    with pytest.MonkeyPatch.context() as patch:
        plant_bias(patch, axis, mm)
        return check(snapshot(store_run(sessions, folder)), baseline)


def assert_found(result: GateResult, axis: str, mm: float) -> None:
    """In every method, as what it is: the camera went one way, what it sees the other."""
    found = {c.method: c.change for c in result.of("regressed") if c.quantity == f"{axis}_mm"}
    assert found == {method: pytest.approx(-mm, abs=0.002) for method in found}
    assert set(found) == {change.method for change in result.changes}


def test_a_planted_bias_is_found_and_a_rerun_is_no_change(nominal: Nominal, tmp_path: Path) -> None:
    with prepared(FEW, nominal) as sessions:
        baseline = snapshot(store_run(sessions, tmp_path / "before"))
        again = check(snapshot(store_run(sessions, tmp_path / "again")), baseline)
        assert {change.p for change in again.changes} == {1.0}
        assert_found(planted(sessions, baseline, "y", MM, tmp_path / "biased"), "y", MM)


@pytest.mark.slow
def test_fifty_trials_show_a_bias_along_each_axis(nominal: Nominal, tmp_path: Path) -> None:
    with prepared(FIFTY, nominal) as sessions:
        baseline = snapshot(store_run(sessions, tmp_path / "before"))
        for axis in "xyz":
            for mm in (MM, -MM):
                folder = tmp_path / f"{axis}{mm}"
                assert_found(planted(sessions, baseline, axis, mm, folder), axis, mm)


@pytest.mark.slow
def test_twenty_unchanged_runs_with_other_seeds_raise_no_alarm(tmp_path: Path) -> None:
    taken = []
    for seed in range(21):
        folder = tmp_path / f"seed{seed}"
        run_scenario(FIFTY.model_copy(update={"seed": seed}), folder)
        taken.append(snapshot(RunStore(folder)))
    results = [check(run, taken[0]) for run in taken[1:]]
    assert not any(result.paired for result in results)
    assert [change for result in results for change in result.of("regressed")] == []
