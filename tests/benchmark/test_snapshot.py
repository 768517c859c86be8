"""A snapshot holds what is stored, world by world, and nothing of an unfinished run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.snapshot import snapshot
from aoicell.benchmark.store import RunStore
from aoicell.errors import InputError
from aoicell.resources import data_root
from aoicell.scenario import Scenario

from .records_by_hand import refused, stored, trial, view

SCENARIO = Scenario(name="s", worlds=3, trials_per_world=2, methods=["paper", "aoicell"])


def records(scenario: Scenario = SCENARIO) -> list[TrialRecord]:
    """Every trial, with a residual that tells world and trial."""
    return [
        trial(t, method, world=w, number=w * 2 + t, views=[view(mm=w + t / 10 + 1 / 30000)])
        for w in range(scenario.worlds)
        for t in range(scenario.trials_per_world)
        for method in scenario.methods
    ]


def test_trials_stand_by_world_and_are_rounded(tmp_path: Path) -> None:
    all_of_them = records()
    all_of_them[0] = refused(0)
    taken = snapshot(stored(tmp_path / "run", all_of_them, scenario=SCENARIO))
    assert list(taken.trials) == [(0, "paper"), (0, "aoicell")]
    ours, paper = taken.trials[0, "aoicell"], taken.trials[0, "paper"]
    np.testing.assert_array_equal(ours.values["residual_mm"], [[0, 0.1], [1, 1.1], [2, 2.1]])
    np.testing.assert_allclose(ours.values["y_mm"][2], [-0.96, -1.008], atol=1e-4)
    np.testing.assert_array_equal(ours.values["detected_px"], np.full((3, 2), 2.0))
    assert paper.outcome.tolist()[0] == ["refused", "corrected"]
    assert np.isnan(paper.values["x_mm"][0, 0])
    assert taken.environment["python"] == "3"


def test_cases_are_kept_apart(tmp_path: Path) -> None:
    sweep = SCENARIO.model_copy(update={"sweep": {"profile": ["ideal", "paper"]}})
    both = [replace(record, case=case) for case in (0, 1) for record in records()]
    both[-1] = replace(both[-1], outcome="failed", views=[])
    taken = snapshot(stored(tmp_path / "run", both, scenario=sweep))
    assert list(taken.trials) == [(c, m) for c in (0, 1) for m in ("paper", "aoicell")]
    assert taken.trials[1, "aoicell"].outcome[2, 1] == "failed"
    assert (taken.trials[0, "aoicell"].outcome == "corrected").all()


def test_an_unfinished_run_is_refused(tmp_path: Path) -> None:
    store = stored(tmp_path / "run", [r for r in records() if r.number != 3], scenario=SCENARIO)
    with pytest.raises(
        InputError, match="1 of 6 trials are missing, the first is world 1, trial 1"
    ):
        snapshot(store)


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a run directory"):
        snapshot(RunStore(tmp_path))


@pytest.mark.parametrize(
    ("folder", "portable"),
    [(data_root() / "cell", ""), (data_root() / "cells" / "b", "cells/b"), (Path("/x/b"), "b")],
)
def test_a_cells_folder_is_named_as_on_another_machine(
    tmp_path: Path, folder: Path, portable: str
) -> None:
    """In the scenario itself and in its cases; its absence must not matter, so none is loaded."""
    scenario = SCENARIO.model_copy(
        update={"cell": str(folder), "cases": {"cell": {"cell": str(folder)}}}
    )
    both = [replace(record, case=case) for case in (0, 1) for record in records()]
    store = stored(tmp_path / "run", both, scenario=scenario)
    store.scenario = lambda: scenario  # type: ignore[method-assign]
    taken = snapshot(store)
    assert taken.scenario.cell == portable
    assert taken.scenario.cases == {"cell": {"cell": portable}}
