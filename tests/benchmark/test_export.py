"""Tables for other programs."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

from aoicell.benchmark.export import export
from aoicell.benchmark.store import RunStore
from aoicell.errors import InputError
from aoicell.scenario import Scenario

from .records_by_hand import refused, stored, trial, view
from .test_inspection_summary import PARTS, board


@pytest.fixture
def store(tmp_path: Path) -> RunStore:
    trials = [trial(views=[view("V1", 1 / 3), view("V2", 2.0, (None,))]), refused(1)]
    return stored(tmp_path / "run", trials)


def test_csv_has_a_row_a_trial_a_view_and_a_marker(store: RunStore, tmp_path: Path) -> None:
    trials, views, markers = export(store, tmp_path / "out", "csv")
    with trials.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["outcome"] for row in rows] == ["corrected", "refused"]
    assert float(rows[0]["residual_mm"]) == (1 / 3 + 2) / 2  # every digit
    assert rows[1]["residual_mm"] == ""
    assert [row["seed"] for row in rows] == ["3", "3"]
    assert "record" not in rows[0]
    with views.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["view"], row["detected_px"]) for row in rows] == [("V1", "2.0"), ("V2", "")]
    with markers.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["view"], row["marker"], row["detected_px"], row["true_px"]) for row in rows] == [
        ("V1", "M2", "2.0", "1.9"), ("V2", "M2", "", "1.9"),
    ]  # fmt: skip


def test_parquet_holds_the_same(store: RunStore, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    trials, _, markers = export(store, tmp_path, "parquet")
    table = parquet.read_table(trials)
    assert table["residual_mm"].to_pylist() == [(1 / 3 + 2) / 2, None]
    assert table["reason"].to_pylist() == ["", "marker M1 is missing"]
    assert table["number"].to_pylist() == [0, 1]
    assert parquet.read_table(markers)["detected_px"].to_pylist() == [2.0, None]


def test_a_run_that_inspects_has_its_boards_too(tmp_path: Path) -> None:
    inspecting = Scenario(name="s", methods=["paper"], inspect=True)
    store = stored(tmp_path / "run", [trial(inspection=board(PARTS))], scenario=inspecting)
    written = {path.stem: path for path in export(store, tmp_path, "csv")}
    assert list(written) == ["trials", "views", "markers", "boards", "parts", "registrations"]
    with written["parts"].open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["component"] for row in rows] == [part.component for part in PARTS]
    assert rows[3]["shift_error_mm"] == "0.04"


def test_without_its_package_parquet_says_what_to_install(
    store: RunStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install 'aoicell\[parquet\]'"):
        export(store, tmp_path, "parquet")


def test_a_run_without_trials_has_empty_tables(tmp_path: Path) -> None:
    trials, *_ = export(stored(tmp_path / "run", []), tmp_path, "csv")
    assert len(trials.read_text().splitlines()) == 1
    assert np.size(RunStore(tmp_path / "run").columns("trials")["number"]) == 0
