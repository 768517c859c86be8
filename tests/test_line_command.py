"""`aoicell line`: what a shell sees."""

import json
from pathlib import Path

import pytest
from helpers.running import Run, run_cli

from aoicell.benchmark.line.store import LineStore

FAST = ("--no-pictures", "--seed", "2", "--mount-mm", "30", "--mount-deg", "3")


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("line") / "run"
    return run_cli("line", *FAST, "--boards", "3", "--out", folder, "--json", folder=folder)


def test_json_goes_to_stdout_and_boards_to_stderr(done: Run) -> None:
    assert done.code == 0, done.stderr
    assert done.summary == json.loads((done.folder / "summary.json").read_text())
    assert done.summary["boards"] == 3
    assert done.summary["first_wrong_verdict_board"] is None
    assert [alarm["what"] for alarm in done.summary["alarms"]] == ["mount", "mount"]
    for said in ("no verdict", "warning: camera mount", "nobody is there to be asked"):
        assert said in done.stderr


def test_chart_and_page_lie_beside_the_boards(done: Run) -> None:
    for name in ("line.png", "line.svg", "line.pdf", "line.html", "boards.sqlite", "line.toml"):
        assert (done.folder / name).stat().st_size > 0, name
    page = (done.folder / "line.html").read_text()
    assert "<svg" in page
    assert "http://" not in page.replace("http://www.w3.org/", "")  # it stands alone
    hint = done.summary["alarms"][0]["hint"]
    assert hint.split(";")[0] in page
    for board in LineStore(done.folder).boards():
        assert board.reason.split("(")[0].replace("'", "&#39;") in page


def test_resume_wants_the_same_options(done: Run) -> None:
    other = run_cli("line", "--no-pictures", "--out", done.folder, "--resume")
    assert other.code == 2
    assert "'seed' = 2, not 0" in other.stderr.strip().splitlines()[-1]


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (("--profile", "perfect"), "'profile' = 'perfect'"),
        (("--mount-mm", "-1"), "'mount_mm' = -1.0: give a number from 0 to 100"),
        (("--defective", "120"), "'defective_percent' = 120.0"),
        (("--views", "nowhere.toml"), "--views nowhere.toml: there is no such file"),
    ],
)
def test_wrong_options_are_one_sentence(
    options: tuple[str, ...], complaint: str, tmp_path: Path
) -> None:
    run = run_cli("line", *options, "--out", tmp_path / "line")
    assert run.code == 2
    assert complaint in " ".join(run.stderr.split())
    assert "Traceback" not in run.stderr
    assert not (tmp_path / "line").exists()


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "line").touch()
    run = run_cli("line", *FAST, "--out", tmp_path / "line")
    assert run.code == 2
    assert "no folder can be made here" in " ".join(run.stderr.split())


def test_help_has_an_example() -> None:
    run = run_cli("line", "--help")
    assert run.code == 0
    assert "Example: aoicell line" in run.stdout
