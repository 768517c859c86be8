"""A baseline reads back as it was, stays small, and says what is wrong with it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.snapshots import changed, noisy

from aoicell.benchmark.baseline import read_baseline, write_baseline
from aoicell.errors import InputError
from aoicell.resources import data_root
from aoicell.scenario import Scenario, load_scenario

SCENARIO = Scenario(
    name="s", title="Ünïcode", worlds=20, trials_per_world=5, seed=7, methods=["paper", "aoicell"]
)
SHIPPED = sorted((data_root() / "scenarios" / "baselines").glob("*.json"))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    outcomes = np.full((20, 5), "corrected")
    outcomes[3, 1:3] = "refused", "failed"
    taken = changed(noisy(SCENARIO), "paper", outcome=outcomes)
    taken.trials[0, "paper"].values["x_mm"][3, 1:3] = np.nan
    write_baseline(tmp_path / "deep" / "b.json", taken)
    return tmp_path / "deep" / "b.json"


def test_it_reads_back_the_same(path: Path) -> None:
    taken, again = noisy(SCENARIO), read_baseline(path)
    assert again.scenario == SCENARIO
    assert again.environment == taken.environment
    assert again.where == str(path)
    for name, values in taken.trials[0, "aoicell"].values.items():
        np.testing.assert_array_equal(again.trials[0, "aoicell"].values[name], values)
    paper = again.trials[0, "paper"]
    assert paper.outcome[3].tolist() == ["corrected", "refused", "failed", *2 * ["corrected"]]
    assert np.isnan(paper.values["x_mm"][3]).tolist() == [False, True, True, False, False]


def test_100_trials_by_two_methods_are_small_and_a_column_is_a_line(path: Path) -> None:
    assert path.stat().st_size < 15_000
    lines = path.read_text().splitlines()
    assert sum(line.startswith('"z_mm": [') for line in lines) == 2


def test_it_is_the_same_file_for_the_same_run(path: Path, tmp_path: Path) -> None:
    write_baseline(tmp_path / "again.json", read_baseline(path))
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_a_key_that_later_versions_add_takes_its_default(path: Path) -> None:
    content = json.loads(path.read_text())
    del content["scenario"]["colour"]
    path.write_text(json.dumps(content))
    assert read_baseline(path).scenario == SCENARIO


def damaged(content: dict[str, Any], kind: str) -> Any:
    first = content["trials"][0]
    match kind:
        case "schema":
            content["schema"] = 2
        case "no schema":
            return [content]
        case "scenario":
            content["scenario"]["worlds"] = 0
        case "cases":
            content["scenario"]["sweep"] = {"seed": 3}
        case "letters":
            first["outcomes"] = "x" * 100
        case "short":
            first["y_mm"].pop()
        case "text":
            first["y_mm"][0] = "0.1"
        case "no method":
            del content["trials"][1]
        case "other method":
            content["trials"].append({**first, "method": "mine"})
        case "new key":
            content["more"] = 1
    return content


@pytest.mark.parametrize(
    ("kind", "complaint"),
    [
        ("schema", "its schema is 2, this version reads 1"),
        ("no schema", "its schema is null"),
        ("scenario", "'worlds': Input should be greater than or equal to 1"),
        ("cases", "'sweep.seed' = 3: give a list"),
        ("letters", "'trials.0.outcomes'"),
        ("short", "case 0, 'paper': 'y_mm' has 99 entries for 100 trials"),
        ("text", "'trials.0.y_mm.0'"),
        ("no method", "case 0 has no trials by 'aoicell'"),
        ("other method", "it has trials of (0, 'mine'), which its scenario does not"),
        ("new key", "'more'"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(path: Path, kind: str, complaint: str) -> None:
    path.write_text(json.dumps(damaged(json.loads(path.read_text()), kind)))
    with pytest.raises(InputError) as error:
        read_baseline(path)
    text = str(error.value)
    assert text.startswith(f"{path}: ")
    assert complaint in text
    assert text.endswith("write it anew with --update")
    assert "\n" not in text


def test_what_is_no_baseline_at_all_is_named(path: Path) -> None:
    path.write_bytes(b"\xff{")
    with pytest.raises(InputError, match="not a readable baseline"):
        read_baseline(path)
    with pytest.raises(InputError, match="there is no such baseline; write it with --update"):
        read_baseline(path.parent / "none.json")
    with pytest.raises(InputError, match="no baseline can be written here"):
        write_baseline(path / "b.json", noisy(SCENARIO))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_baseline_is_of_its_scenario(path: Path) -> None:
    beside, shipped = path.with_suffix(".toml"), path.parents[1] / f"{path.stem}.toml"
    scenario = load_scenario(beside if beside.exists() else shipped)
    assert read_baseline(path).scenario == scenario.model_copy(update={"cell": ""})
    assert path.stat().st_size < 30_000
