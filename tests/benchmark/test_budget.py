"""The error budget on a few cheap cells: the same on any number of workers, and its statistics."""

from concurrent.futures import ThreadPoolExecutor
from itertools import islice

import numpy as np
import pytest

from aoicell.benchmark import budget
from aoicell.benchmark.budget import Estimate, as_rows, cases, percentile_of, run_budget, shares
from aoicell.benchmark.sources import SOURCES
from aoicell.benchmark.workers import local_workers
from aoicell.report.budget import budget_chart, budget_table, conclusion, reproduction_chart
from aoicell.resources import find
from aoicell.scenario import Scenario, load_scenario


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load_scenario(find("scenarios", "error_budget"), worlds=2)


def estimate(*cells: float) -> Estimate:
    return Estimate(float(np.mean(cells)), min(cells), max(cells), cells)


def test_cases_are_all_then_each_source_alone_and_all_but_it(scenario: Scenario) -> None:
    listed = [(case.kind, case.source) for case in cases(scenario)]
    assert listed[0] == ("all", "")
    assert {source for kind, source in listed if kind == "alone"} == set(SOURCES)
    assert {source for kind, source in listed if kind == "without"} == set(SOURCES)


def test_a_source_that_is_off_is_no_case(scenario: Scenario) -> None:
    only_arm = scenario.model_copy(update={"profile": "ideal", "knobs": {"joint_zero_deg": 0.1}})
    assert [case.source for case in cases(only_arm) if case.kind == "alone"] == ["arm geometry"]


def test_the_same_numbers_on_any_number_of_workers(
    scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(budget, "cases", lambda s: islice(cases(s), 2))
    seen: list[tuple[int, int]] = []
    with ThreadPoolExecutor(1) as one:
        alone = run_budget(scenario, one, lambda *counts: seen.append(counts))
    assert seen == [(n, 4) for n in (1, 2, 3, 4)]
    with local_workers(2) as two:
        shared = run_budget(scenario, two, lambda *counts: None)
    assert as_rows(alone)
    assert as_rows(alone) == as_rows(shared)
    for method in scenario.methods:
        assert alone.refused["all", "", method] == 0
        everything = alone.table["all", "", method, "residual_mm"]
        assert len(everything.cells) == scenario.worlds
        assert everything.low <= everything.mean <= everything.high


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


def a_table(lateral: float) -> budget.Table:
    table = {}
    for method in ("paper", "aoicell"):
        for quantity in budget.QUANTITIES:
            table["all", "", method, quantity] = estimate(lateral, lateral * 1.5)
            for source in SOURCES:
                table["alone", source, method, quantity] = estimate(0.1, 0.2)
            table["alone", "gravity", method, quantity] = estimate(1.0, 2.0)
    return table


def test_the_conclusion_names_the_largest_source_and_the_papers_place() -> None:
    inside = conclusion(a_table(3.5), ["paper", "aoicell"])
    assert "paper is left with 4.38 mm" in inside
    assert "most come from gravity (" in inside
    assert "mean of 3.97 mm at the 50th" in inside
    assert "mean of 3.97 mm at the 100th" in conclusion(a_table(0.1), ["paper", "aoicell"])
    assert conclusion({}, ["aoicell"]) == "aoicell corrected no trial with all sources together."


def test_table_and_charts_can_be_drawn() -> None:
    table = a_table(3.5)
    study = budget.Budget(table, {}, trials=4)
    assert budget_table(study, ["paper", "aoicell"]).row_count == 2 * (len(SOURCES) + 1)
    assert len(budget_chart(table, ["paper", "aoicell"]).axes) == 2
    assert len(reproduction_chart(table).axes) == 2
