"""What a result depends on beside the scenario."""

import json
from pathlib import Path

import pytest

from aoicell import __version__
from aoicell.benchmark import environment
from aoicell.benchmark.environment import PACKAGES, describe_environment, git_state


def test_it_names_every_package_and_can_be_written() -> None:
    described = describe_environment()
    assert set(described) == {"python", "platform", "machine", "packages", "git"}
    assert set(described["packages"]) == set(PACKAGES)
    assert described["packages"]["aoicell"] == __version__
    assert described["packages"]["mujoco"].startswith("4.")
    assert json.loads(json.dumps(described)) == described


def test_a_package_that_is_not_there_is_null(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(environment, "PACKAGES", ("no-such-package",))
    assert describe_environment()["packages"] == {"no-such-package": None}


def test_outside_a_checkout_there_is_no_git_state(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    monkeypatch.setattr(environment, "data_root", lambda: tmp_path)
    assert git_state() is None


def test_without_git_there_is_none_either(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert git_state() is None
