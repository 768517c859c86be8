"""The right numbers stand in the right rows."""

import re
from io import StringIO
from pathlib import Path

import pytest
from benchmark.records_by_hand import refused, stored, trial, view, world
from rich.console import Console
from rich.table import Table

from aoicell.benchmark.records import TrialRecord, WorldRecord
from aoicell.benchmark.summary import summarise
from aoicell.report.tables import (
    hand_eye_table,
    inspection_tables,
    residual_table,
    summary_table,
)
from aoicell.scenario import Scenario
from report import inspection_runs

SCENARIO = Scenario(name="s", methods=["paper", "aoicell"])


def rendered(table: Table, width: int = 120) -> list[str]:
    """The lines of a table, without its frame."""
    output = StringIO()
    Console(file=output, width=width).print(table)
    lines = output.getvalue().splitlines()
    return [re.sub(r"[^\w\s.,:;()%±'/-]", " ", line).strip() for line in lines]


def numbers(table: Table, row: str) -> list[float]:
    """The numbers of the one row that starts with these words."""
    found = [line.removeprefix(row) for line in rendered(table) if line.startswith(row)]
    assert len(found) == 1, found
    return [float(text) for text in re.findall(r"-?\d+\.?\d*", found[0])]


def summary(folder: Path, trials: list[TrialRecord], worlds: list[WorldRecord]) -> Table:
    store = stored(folder, trials, worlds, SCENARIO)
    few = trials if len({t.trial for t in trials}) <= 4 else []
    return summary_table(summarise(SCENARIO, store, 1.0, 0.5), few)


def test_hand_eye_beside_truth_and_the_paper() -> None:
    table = hand_eye_table([world()])
    assert numbers(table, "printed in the paper") == [9, 2]
    assert numbers(table, "as built (truth)") == [9.1, 0.1, 2.1]
    turn = round((0.1**2 + 0.2**2 + 0.3**2) ** 0.5, 2)
    assert numbers(table, "paper") == [9, 0, 2, turn, 0.2, 0.01]


def test_hand_eye_says_how_many_worlds_it_leaves_out() -> None:
    text = " ".join(rendered(hand_eye_table([world(k) for k in range(5)])))
    assert "world 3: paper" in text
    assert "world 4" not in text
    assert "the first 3 of 5 worlds" in text


def test_residuals_by_view_and_marker() -> None:
    trials = [
        trial(0, views=[view("V1", px=(2.0,)), view("V2", px=(4.0, 6.0))]),
        trial(1, views=[view("V1", px=(1.0,)), view("V2", px=(3.0, None))]),
        trial(0, "aoicell", views=[view("V1", px=(0.5,))]),
    ]
    table = residual_table(trials, "paper")
    assert numbers(table, "V1 M2") == [2, 1.9, 0.38, 1, 1.9, 0.19]
    assert numbers(table, "V2 M2") == [4, 1.9, 0.76, 3, 1.9, 0.57]
    assert numbers(table, "V2 M3") == [6, 1.9, 1.14, 1.9]  # not detected in test 2, but there
    assert numbers(table, "mean") == pytest.approx([3.5, 1.9, 0.665, 2, 1.9, 0.38], abs=0.006)
    assert numbers(residual_table(trials, "aoicell"), "V1 M2")[0] == 0.5


def test_a_refused_trial_is_named_with_its_reason() -> None:
    table = residual_table([trial(0), refused(1)], "paper")
    assert numbers(table, "V1 M2") == [2, 1.9, 0.38]
    text = " ".join(rendered(table))
    assert "refused" in text
    assert "marker M1 is missing" in text


def test_the_summary_of_few_trials_shows_each(tmp_path: Path) -> None:
    trials = [
        trial(0, views=[view(mm=5.0, px=(20.0,))]),
        trial(1, views=[view(mm=3.0, px=(10.0,))]),
        trial(0, "aoicell", views=[view(mm=0.1, px=(0.5,))]),
        refused(1, "aoicell"),
    ]
    table = summary(tmp_path, trials, [world(floor=0.031)])
    assert numbers(table, "paper as printed, test 1") == [49.1, 5.15, 91.5]
    assert numbers(table, "paper as printed, test 2") == [50.6, 3.8, 92.5]
    assert numbers(table, "paper as printed, mean") == [3.97, 21.09]
    first = numbers(table, "paper, test 1")
    assert (first[:4], first[-2:]) == ([50, 5, 3, 4], [20, 90])
    mean = numbers(table, "paper, mean of 2")
    assert (mean[:4], mean[-2:]) == ([50, 4, 2.4, 3.2], [15, 92])
    assert numbers(table, "aoicell, test 2: refused") == [250]
    alone = numbers(table, "aoicell, mean of 1")  # the refused one does not dilute it
    assert (alone[:2], alone[-1]) == ([50, 0.1], 99.8)
    assert numbers(table, "aoicell: 1 refused") == [0]
    assert numbers(table, "floor") == [0.031]


def test_the_summary_of_many_trials_shows_statistics(tmp_path: Path) -> None:
    trials = [trial(k, views=[view(mm=float(k))]) for k in range(1, 21)] + [refused(21)]
    table = summary(tmp_path, trials, [world()])
    assert numbers(table, "paper, mean of 20")[:2] == [50, 10.5]
    assert numbers(table, "paper, 95th percentile")[:2] == [50, pytest.approx(19.05)]
    assert numbers(table, "paper: 1 refused") == [0]
    assert not [line for line in rendered(table) if line.startswith("paper, test")]


def test_a_run_in_which_all_was_refused_still_has_its_tables(tmp_path: Path) -> None:
    trials = [refused(0), refused(1)]
    assert numbers(residual_table(trials, "paper"), "mean") == []
    table = summary(tmp_path, trials, [world()])
    assert numbers(table, "paper, mean of 0") == []


def test_an_inspection_has_a_column_a_method(tmp_path: Path) -> None:
    store = inspection_runs.finished(tmp_path, inspection_runs.records())
    headline, by_kind = inspection_tables(store.read_json("summary.json"))
    assert numbers(headline, "boards") == [2, 2, 2]
    assert numbers(headline, "planted defects") == [2, 4, 4]
    assert numbers(headline, "detection rate, %") == [0, 75, 100, 99]  # the last is asked for
    assert numbers(headline, "false calls, %") == [0, 0.51, 0, 0.1]
    assert numbers(headline, "parts without a verdict") == [200, 0, 0]
    assert numbers(by_kind, "missing") == [0, 2, 0, 1, 2, 50, 2, 2, 100]
    assert numbers(by_kind, "shifted") == [0, 0, 2, 2, 100, 2, 2, 100]  # none in view


def test_an_inspection_without_defects_has_no_table_by_kind(tmp_path: Path) -> None:
    good = [
        inspection_runs.board(0, method, inspection_runs.inspected())
        for method in inspection_runs.METHODS
    ]
    summary = inspection_runs.finished(tmp_path, good).read_json("summary.json")
    [headline] = inspection_tables(summary)
    assert numbers(headline, "good parts") == [100, 100, 100]
