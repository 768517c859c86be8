"""What the README says can be typed, can be typed."""

import re
from pathlib import Path

import pytest

from aoicell.cli import app
from aoicell.scenario import cases_of, load_scenario

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def test_the_session_runs(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    (session,) = [block for block in blocks if block.startswith("import aoicell")]
    exec(session, {})
    printed = capsys.readouterr().out
    assert re.search(r"^paper \[.*\] mm left$", printed, re.MULTILINE)
    assert re.search(r"^aoicell \[.*\] mm left$", printed, re.MULTILINE)


def test_every_command_of_the_table_exists_and_every_command_is_in_it() -> None:
    named = set(re.findall(r"^\| `aoicell (\w+)", README, re.MULTILINE))
    known = {command.callback.__name__ for command in app.registered_commands if command.callback}
    assert named == known | {group.name for group in app.registered_groups}


def test_the_scenario_it_shows_is_a_legal_one(tmp_path: Path) -> None:
    (text,) = [b for b in re.findall(r"```toml\n(.*?)```", README, re.DOTALL) if "[sweep" in b]
    (tmp_path / "s.toml").write_text(text)
    assert len(cases_of(load_scenario(tmp_path / "s.toml"))) == 3


def test_make_targets_and_linked_files_exist() -> None:
    targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert set(re.findall(r"`?make (demo|test|setup)", README)) <= set(targets)
    for link in re.findall(r"\]\(([^)]+)\)", README):
        assert (ROOT / link).exists(), link


def test_no_placeholder_is_left() -> None:
    for page in (README, (ROOT / "scenarios" / "README.md").read_text()):
        assert not re.search(r"^[A-Z_]{5,}( |$)", page, re.MULTILINE)
