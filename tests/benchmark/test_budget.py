"""The error budget of a run, and its statistics."""

from pathlib import Path

import numpy as np
import pytest

from aoicell.benchmark.budget import Estimate, percentile_of, read_budget, shares
from aoicell.errors import AoicellError, InputError
from aoicell.resources import find
from aoicell.scenario import Scenario, cases_of, load_scenario
from aoicell.sim.sources import SOURCES

from .records_by_hand import refused, stored, trial, view

TWO = {"isolate": ["gravity"], "ablate": ["gravity"], "methods": ["paper"]}


def estimate(*cells: float) -> Estimate:
    return Estimate(float(np.mean(cells)), min(cells), max(cells), cells, cells)


@pytest.fixture
def scenario() -> Scenario:
    return Scenario(name="s", profile="paper", worlds=2, **TWO)  # type: ignore[arg-type]


def test_the_shipped_budget_has_each_source_alone_and_all_but_it() -> None:
    cases = cases_of(load_scenario(find("scenarios", "error_budget")))
    assert (cases[0].kind, cases[0].label) == ("as it stands", "")
    for kind in ("alone", "without"):
        assert {case.label for case in cases if case.kind == kind} == set(SOURCES)


def test_a_cells_value_is_the_mean_of_its_tests(tmp_path: Path, scenario: Scenario) -> None:
    trials = [
        trial(0, views=[view(mm=1.0)]),
        trial(1, views=[view(mm=3.0)]),
        trial(0, world=1, views=[view(mm=6.0)]),
        refused(1, world=1),
        trial(0, case=1, views=[view(mm=0.5)]),
        refused(0, case=2),
    ]
    study = read_budget(stored(tmp_path, trials, scenario=scenario))
    everything = study.table["all", "", "paper", "residual_mm"]
    assert everything.cells == (2.0, 6.0)
    assert everything.tests == (1.0, 3.0, 6.0)
    assert everything.mean == 4.0
    assert everything.low <= everything.mean <= everything.high
    assert study.table["alone", "gravity", "paper", "residual_mm"].cells == (0.5,)
    assert ("without", "gravity", "paper", "residual_mm") not in study.table
    assert study.refused == {
        ("all", "", "paper"): 1,
        ("alone", "gravity", "paper"): 0,
        ("without", "gravity", "paper"): 1,
    }


def test_a_defect_is_no_residual(tmp_path: Path, scenario: Scenario) -> None:
    failed = trial(0, outcome="failed", reason="ZeroDivisionError: x", views=[])
    with pytest.raises(AoicellError, match="a trial failed, ZeroDivisionError"):
        read_budget(stored(tmp_path, [failed], scenario=scenario))


def test_another_run_has_no_budget(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its scenario needs isolate and ablate"):
        read_budget(stored(tmp_path, [trial()]))


def test_shares_are_of_the_squares_and_add_up() -> None:
    table = {
        ("alone", "gravity", "paper", "residual_mm"): estimate(3.0, 3.0),
        ("alone", "focal drift", "paper", "residual_mm"): estimate(4.0, 4.0),
        ("without", "gravity", "paper", "residual_mm"): estimate(9.0),
    }
    found = shares(table, "paper", "residual_mm")
    assert found == pytest.approx({"gravity": 9 / 25, "focal drift": 16 / 25})
    assert shares(table, "aoicell", "residual_mm") == {}


def test_a_percentile_is_the_share_below() -> None:
    assert percentile_of(2.5, [1, 2, 3, 4]) == 50
    assert percentile_of(0.0, [1, 2]) == 0
