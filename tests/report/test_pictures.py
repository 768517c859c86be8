"""Offsets are drawn large enough to be seen, and a picture that is missing says why."""

from io import StringIO
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from benchmark.records_by_hand import refused, stored, trial, world
from rich.console import Console

from aoicell.benchmark.records import MarkerRecord, TrialRecord
from aoicell.benchmark.summary import summarise
from aoicell.report.pictures import magnification, view_comparison
from aoicell.report.style import NEW, STANDARD, new_figure, save
from aoicell.report.tables import residual_table, summary_table
from aoicell.scenario import Scenario

CROSSES = np.array([[0.0, 0], [100, 0], [100, 100], [0, 100]])


def shifted(px: float) -> MarkerRecord:
    after = np.add(CROSSES, [px, 0]).tolist()
    return MarkerRecord("M2", px, px, px, CROSSES.tolist(), after)


@pytest.mark.parametrize(("px", "expected"), [(1.9, 20), (21.0, 1), (0.5, 50), (0.0, 200), (90, 1)])
def test_the_longest_offset_stays_below_the_next_cross(px: float, expected: int) -> None:
    assert magnification([shifted(px), shifted(px / 3)]) == expected


def test_the_figure_names_what_was_refused(tmp_path: Path) -> None:
    standard = tmp_path / "standard.png"
    cv2.imwrite(str(standard), np.full((60, 80, 3), 90, np.uint8))
    figure = view_comparison("V1", standard, [(refused(0), tmp_path / "absent.png")])
    texts = [text.get_text() for ax in figure.axes for text in [ax.title, *ax.texts]]
    assert texts == ["V1, standard image", "paper, test 1: refused", "marker M1 is missing"]


def test_photographs_are_small_and_marks_keep_their_colours(tmp_path: Path) -> None:
    figure = new_figure(6, 4)
    ax = figure.subplots()
    ax.imshow(np.random.default_rng(0).integers(60, 90, (300, 400, 3), dtype=np.uint8))
    ax.plot([50, 350], [50, 250], color=NEW, linewidth=4)
    ax.plot([50, 350], [250, 50], color=STANDARD, linewidth=4)
    (path,) = save(figure, tmp_path / "photo", vector=False)
    image = cv2.imread(str(path))
    assert image is not None
    for colour in (NEW, STANDARD, "#FFFFFF"):
        bgr = [int(colour[i : i + 2], 16) for i in (5, 3, 1)]
        assert (image == bgr).all(axis=2).sum() > 200
    assert path.stat().st_size < image.size / 2


def summary_of(folder: Path, trials: list[TrialRecord]) -> dict[str, Any]:
    scenario = Scenario(name="s", methods=["paper", "aoicell"])
    return summarise(scenario, stored(folder, trials, [world()], scenario), 1.0, 0.5)


def test_tables_fit_80_columns_and_name_every_refusal(tmp_path: Path) -> None:
    trials = [
        trial(0, "aoicell"),
        trial(1, "aoicell"),
        refused(0),
        trial(1, outcome="refused", reason="M1 [0 of 4] at P_check", views=[]),
    ]
    tables = [
        residual_table(trials, "paper"),
        summary_table(summary_of(tmp_path, trials), trials),
    ]
    for table in tables:
        output = StringIO()
        Console(file=output, width=80).print(table)
        text = output.getvalue()
        assert "…" not in text
        text = " ".join(text.split())
        assert "test 1 was refused: marker M1 is missing" in text
        assert "test 2 was refused: M1 [0 of 4] at P_check" in text


def test_tests_of_several_worlds_are_told_apart(tmp_path: Path) -> None:
    trials = [trial(0), trial(0, world=1)]
    output = StringIO()
    Console(file=output, width=100).print(summary_table(summary_of(tmp_path, trials), trials))
    assert "paper, world 2 test 1" in output.getvalue()
