"""The error budget's table, charts and words: heights, percentiles, what is compared with what."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from aoicell.benchmark.budget import QUANTITIES, Budget, Estimate, Table
from aoicell.report.budget import (
    AMONG,
    COLOURS,
    budget_chart,
    budget_table,
    conclusion,
    percentiles,
    reproduction_chart,
)
from aoicell.sim.sources import SOURCES

METHODS = ("paper", "aoicell")


def estimate(cells: Sequence[float], tests: Sequence[float] = ()) -> Estimate:
    every = tuple(tests) or tuple(cells)
    return Estimate(float(np.mean(cells)), min(cells), max(cells), tuple(cells), every)


def a_table(cells: Sequence[float], tests: Sequence[float] = ()) -> Table:
    """Gravity contributes 3 and the lens 4, the other sources nothing."""
    alone = {"gravity": 3.0, "lens and sensor geometry": 4.0}
    table = {}
    for method in METHODS:
        for quantity in QUANTITIES:
            table["all", "", method, quantity] = estimate(cells, tests)
            for source in SOURCES:
                table["alone", source, method, quantity] = estimate([alone.get(source, 0.0)])
    return table


def bars(ax: Axes) -> dict[Any, float]:
    """Heights of the bars of a panel by colour."""
    return {
        patch.get_facecolor(): patch.get_height()
        for patch in ax.patches
        if isinstance(patch, Rectangle)
    }


def test_the_stack_divides_the_mean_as_the_squares_are() -> None:
    figure = budget_chart(a_table([8.0, 12.0]), METHODS)
    *stacks, _ = figure.axes
    titles = [ax.get_title() for ax in stacks]
    assert titles == ["paper, mm", "paper, px", "aoicell, mm", "aoicell, px"]
    for ax in stacks:
        heights = [height for height in bars(ax).values() if height]
        assert heights == pytest.approx([10 * 9 / 25, 10 * 16 / 25])
        (interval,) = ax.collections[0].get_paths()
        assert np.asarray(interval.vertices)[:, 1].tolist() == [8.0, 12.0]


def test_every_source_has_a_colour_of_its_own() -> None:
    assert set(COLOURS) == set(SOURCES)
    assert len(set(COLOURS.values())) == len(SOURCES)


def test_each_source_alone_stands_at_its_mean() -> None:
    ax = budget_chart(a_table([10.0]), METHODS).axes[-1]
    assert [label.get_text() for label in ax.get_yticklabels()] == list(SOURCES)
    means, _ = ax.containers[0].lines[0].get_data()  # type: ignore[attr-defined]
    assert means[list(SOURCES).index("lens and sensor geometry")] == 4.0
    assert means[list(SOURCES).index("placement")] == 0.0


def test_single_tests_stand_among_tests_and_means_among_cells() -> None:
    table = a_table(cells=[3.9, 4.0, 25.0, 26.0], tests=[4.0, 5.0, 5.1, 5.2, 5.3])
    shares = {str(printed): (printed.among, share) for printed, share in percentiles(table)}
    assert shares == {
        "test 1 of 5.15 mm": ("tests", 60.0),
        "test 2 of 3.80 mm": ("tests", 0.0),
        "mean of 3.97 mm": ("cells", 25.0),
        "mean of 21.09 px": ("cells", 50.0),
    }


def test_the_reproduction_has_both_curves_and_the_papers_figures() -> None:
    table = a_table(cells=[3.9, 4.0, 25.0, 26.0], tests=[4.0, 5.0, 5.1, 5.2, 5.3])
    mm, px = reproduction_chart(table).axes
    for ax in (mm, px):
        labels = [text.get_text() for text in ax.get_legend().get_texts()]  # type: ignore[union-attr]
        assert labels[:2] == [name for name, _ in AMONG.values()]
        assert max(ax.lines[0].get_xdata()) == 5.3  # type: ignore[type-var, arg-type]
        assert max(ax.lines[1].get_xdata()) == 26.0  # type: ignore[type-var, arg-type]
    marked = {float(line.get_xdata()[0]) for line in mm.lines[2:]}  # type: ignore[index, arg-type]
    assert marked == {5.15, 3.80, 3.97}
    assert "percentile 60 of single tests" in str(mm.get_legend().get_texts()[2])  # type: ignore[union-attr]


def test_the_conclusion_names_the_largest_source_and_the_papers_place() -> None:
    text = conclusion(a_table([3.5, 5.25]), METHODS)
    assert "paper is left with 4.38 mm" in text
    assert "most come from lens and sensor geometry (64 %)" in text
    assert "mean of 3.97 mm at percentile 50 of the cells' means" in text
    assert conclusion({}, ["aoicell"]) == "aoicell corrected no trial with all sources together."


def test_the_conclusion_says_what_lies_outside_and_on_which_side() -> None:
    below, above = conclusion(a_table([0.1]), METHODS), conclusion(a_table([99.0]), METHODS)
    assert "The test 1 of 5.15 mm lies outside: each of the single tests leaves less." in below
    assert "The mean of 21.09 px lies outside: each of the cells' means leaves more." in above
    assert "outside" not in conclusion(a_table([1.0, 30.0]), METHODS)


def test_the_table_has_a_row_for_each_source_and_the_sum() -> None:
    study = Budget(a_table([3.5]), {}, trials=4)
    assert budget_table(study, METHODS).row_count == len(METHODS) * (len(SOURCES) + 1)


def test_a_method_that_corrected_nothing_leaves_its_panel_empty() -> None:
    table = {key: value for key, value in a_table([3.5]).items() if key[2] == "paper"}
    *stacks, _ = budget_chart(table, METHODS).axes
    assert [bool(ax.patches) for ax in stacks] == [True, True, False, False]
