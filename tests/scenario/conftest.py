"""A folder that lies beside the shipped cell, as `scenarios/` does."""

from pathlib import Path

import pytest

from aoicell.resources import data_root


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cell").symlink_to(data_root() / "cell")
    (tmp_path / "scenarios").mkdir()
    return tmp_path / "scenarios"
