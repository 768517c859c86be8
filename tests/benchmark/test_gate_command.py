"""`aoicell check`: exit codes, files, and one sentence for each mistake."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from helpers.running import Run, run_cli
from helpers.snapshots import noisy, shifted, stored

import aoicell.cli.check  # noqa: F401 - adds the command
from aoicell.benchmark.baseline import read_baseline, write_baseline
from aoicell.scenario import Scenario

SCENARIO = Scenario(
    name="ten", worlds=10, trials_per_world=5, methods=["paper", "aoicell"], pictures=False
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A run, and baselines that it equals, and that it is worse than."""
    run = noisy(SCENARIO)
    stored(run, tmp_path / "run")
    write_baseline(tmp_path / "same.json", run)
    write_baseline(tmp_path / "better.json", shifted(run, "aoicell", z_mm=-0.05))
    return tmp_path


def gate(folder: Path, baseline: str, *options: str | Path) -> Run:
    return run_cli("check", folder / "run", "--baseline", folder / baseline, *options)


def test_a_run_that_is_as_good_exits_0(folder: Path) -> None:
    run = gate(folder, "same.json")
    assert (run.code, run.stderr) == (0, "")
    assert "of 18 quantities none changed" in run.stdout


def test_a_worse_run_exits_1_with_the_table_and_a_sentence(folder: Path) -> None:
    run = gate(folder, "better.json")
    assert run.code == 1
    assert "regressed" in run.stdout
    assert run.stderr == ("aoicell: worse than the baseline; ten: of 18 quantities 1 regressed\n")


def test_json_is_all_there_is_on_stdout(folder: Path) -> None:
    result = json.loads(gate(folder, "better.json", "--json").stdout)
    assert (result["passed"], result["paired"], result["scenario"]) == (False, True, "ten")
    (worse,) = [c for c in result["changes"] if c["verdict"] == "regressed"]
    assert (worse["method"], worse["quantity"], worse["unit"]) == ("aoicell", "z_mm", "mm")
    assert worse["change"] == pytest.approx(0.05)


def test_the_practical_sizes_are_options(folder: Path) -> None:
    assert gate(folder, "better.json", "--practical-mm", "0.06").code == 0
    run = gate(folder, "better.json", "--practical-px", "-1")
    assert run.code == 2
    assert "practical size in px = -1.0" in run.stderr


def test_junit_is_written_and_markdown_is_appended(folder: Path) -> None:
    summary = folder / "summary.md"
    summary.write_text("before\n")
    gate(folder, "better.json", "--junit", folder / "j.xml", "--markdown", summary)
    (suite,) = ElementTree.parse(folder / "j.xml").getroot()
    assert suite.get("failures") == "1"
    assert summary.read_text().startswith("before\n### ❌ ten")
    run = gate(folder, "same.json", "--junit", folder)
    assert run.code == 2
    assert f"--junit {folder}: cannot be written" in run.stderr


def test_only_update_writes_the_baseline(folder: Path) -> None:
    before = (folder / "better.json").read_bytes()
    gate(folder, "better.json")
    assert (folder / "better.json").read_bytes() == before
    run = gate(folder, "better.json", "--update")
    assert (run.code, run.stdout) == (0, "")
    assert "replaced, 50 trials by paper and aoicell of 'ten', seed 0" in run.stderr
    assert "new, 50 trials" in gate(folder, "deep/new.json", "--update").stderr
    for name in ("better.json", "deep/new.json"):
        assert read_baseline(folder / name).scenario == SCENARIO
        assert gate(folder, name).code == 0


def test_other_seeds_with_few_worlds_exit_3(folder: Path) -> None:
    few = noisy(SCENARIO.model_copy(update={"worlds": 2, "seed": 1}))
    write_baseline(folder / "few.json", few)
    run = gate(folder, "few.json")
    assert run.code == 3
    assert "one of them has 2 worlds" in run.stderr


@pytest.mark.parametrize(
    ("name", "complaint"),
    [("none.json", "there is no such baseline"), ("run/scenario.toml", "not a readable baseline")],
)
def test_a_baseline_that_is_none_exits_2(folder: Path, name: str, complaint: str) -> None:
    run = gate(folder, name)
    assert run.code == 2
    assert complaint in run.stderr
    assert "Traceback" not in run.stderr


def test_a_folder_that_is_no_run_exits_2(tmp_path: Path) -> None:
    run = run_cli("check", tmp_path, "--baseline", tmp_path / "b.json", "--update")
    assert run.code == 2
    assert "not a run directory" in run.stderr
    assert list(tmp_path.iterdir()) == []
