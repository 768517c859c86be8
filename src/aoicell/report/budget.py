"""The error budget for the eye: table, stacked chart, the paper's place, one paragraph."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.box import SIMPLE
from rich.table import Table as TextTable

from aoicell.benchmark.budget import Budget, Table, as_rows, percentile_of, shares
from aoicell.benchmark.sources import SOURCES
from aoicell.report import paper
from aoicell.report.style import METHOD_COLOURS, REFERENCE, new_figure
from aoicell.scenario import Scenario

# the paper's millimetres are pixels times a scale: only the lateral part compares with them
PRINTED = (
    ("test 1", paper.TESTS[0].left_mm, "lateral_mm"),
    ("test 2", paper.TESTS[1].left_mm, "lateral_mm"),
    ("mean", paper.MEAN_MM, "lateral_mm"),
    ("mean", paper.MEAN_PX, "true_px"),
)


def budget_table(budget: Budget, methods: Sequence[str]) -> TextTable:
    """Each source alone and all but each, in mm and px, with 95 % confidence intervals."""
    text = TextTable(
        title="Error budget: mean residual over the drawn cells, ± half of the 95 % interval",
        title_justify="left", box=SIMPLE,
        caption="Points are projected: light, surfaces and blur act through the detection noise "
        "only. refused: trials of the case that were declined, left out of its mean.",
    )  # fmt: skip
    for column in ("method", "source"):
        text.add_column(column, no_wrap=True)
    for column in ("alone mm", "alone px", "all but it mm", "all but it px", "refused"):
        text.add_column(column, justify="right")
    table = budget.table
    for method in methods:
        for source in SOURCES:
            cells = [
                _cell(table, (kind, source, method, quantity), digits)
                for kind in ("alone", "without")
                for quantity, digits in (("residual_mm", 3), ("true_px", 2))
            ]
            declined = sum(budget.refused.get((k, source, method), 0) for k in ("alone", "without"))
            text.add_row(method, source, *cells, str(declined))
        total = [
            _cell(table, ("all", "", method, q), d) for q, d in (("residual_mm", 3), ("true_px", 2))
        ]
        declined = budget.refused.get(("all", "", method), 0)
        text.add_row(method, "all together", *total, "", "", str(declined), end_section=True)
    return text


def _cell(table: Table, key: tuple[str, str, str, str], digits: int) -> str:
    estimate = table.get(key)
    if estimate is None:
        return "-"
    half = (estimate.high - estimate.low) / 2
    return f"{estimate.mean:.{digits}f} ±{half:.{digits}f}"


def budget_chart(table: Table, methods: Sequence[str]) -> Figure:
    """Left: shares of the squared contributions, stacked. Right: each source alone, with its CI."""
    figure = new_figure(12, 5.2)
    left, right = figure.subplots(1, 2, width_ratios=[1, 1.5])
    colours = [f"C{i}" for i in range(10)] + ["#333333"]
    bars = [(method, quantity) for method in methods for quantity in ("residual_mm", "true_px")]
    names = [f"{method}\n{quantity.rsplit('_', 1)[1]}" for method, quantity in bars]
    bottom = np.zeros(len(bars))
    for source, colour in zip(SOURCES, colours, strict=True):
        part = np.array([100 * shares(table, *bar).get(source, 0.0) for bar in bars])
        left.bar(names, part, bottom=bottom, color=colour, label=source, width=0.7)
        bottom += part
    left.set_ylabel("share of the sum of squares, %")
    left.set_title("Contributions of the sources, each alone", fontsize=10)
    positions = np.arange(len(SOURCES))
    for offset, method in zip(np.linspace(-0.18, 0.18, len(methods)), methods, strict=True):
        found = [table.get(("alone", source, method, "residual_mm")) for source in SOURCES]
        mean = np.array([e.mean if e else np.nan for e in found])
        low = np.array([e.mean - e.low if e else np.nan for e in found])
        high = np.array([e.high - e.mean if e else np.nan for e in found])
        right.errorbar(
            mean, positions + offset, xerr=[low, high], fmt="o", markersize=5, capsize=3,
            color=METHOD_COLOURS.get(method), label=f"{method}, source alone",
        )  # fmt: skip
        everything = table.get(("all", "", method, "residual_mm"))
        if everything is None:
            continue
        right.axvline(
            everything.mean, color=METHOD_COLOURS.get(method), linestyle="--", linewidth=1,
            label=f"{method}, all together",
        )  # fmt: skip
    right.set_yticks(positions, list(SOURCES))
    right.invert_yaxis()
    right.set_xscale("symlog", linthresh=1e-2)
    right.set_xlim(left=0)
    right.set_xlabel("mean residual, mm (95 % confidence)")
    right.grid(axis="x", alpha=0.3, which="both")
    right.legend(fontsize=8)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4,
                  fontsize=8, frameon=False)  # fmt: skip
    return figure


def reproduction_chart(table: Table) -> Figure:
    """Where the paper's printed figures fall in the distribution of the drawn cells."""
    figure = new_figure(10, 4)
    axes = figure.subplots(1, 2)
    panels = (("lateral_mm", "mean lateral residual of the two tests, mm"),
              ("true_px", "mean distance of the markers, px"))  # fmt: skip
    for ax, (quantity, label) in zip(axes, panels, strict=True):
        everything = table.get(("all", "", "paper", quantity))
        if everything is None:
            continue
        cells = everything.cells
        ax.ecdf(cells, color=METHOD_COLOURS["paper"])
        printed = [(name, value) for name, value, q in PRINTED if q == quantity]
        for index, (name, value) in enumerate(printed):
            share = percentile_of(value, cells)
            ax.axvline(value, color=REFERENCE, linestyle="--", linewidth=1)
            ax.annotate(
                f"paper {name} {value:g}: {share:.0f}th percentile", (value, 0.1 + 0.2 * index),
                xytext=(-4, 0), textcoords="offset points", fontsize=8, ha="right",
            )  # fmt: skip
        ax.set_xlim(left=0)
        ax.set_xlabel(label)
        ax.set_ylabel("share of cells")
        ax.grid(alpha=0.25, which="both")
    figure.suptitle(
        "Method paper over the drawn cells, and the figures that the paper prints", fontsize=10
    )
    return figure


def conclusion(table: Table, methods: Sequence[str]) -> str:
    """One paragraph, written from the figures."""
    sentences = []
    for method in methods:
        total = table.get(("all", "", method, "residual_mm"))
        ranked = sorted(shares(table, method, "residual_mm").items(), key=lambda item: -item[1])
        if total is None:
            sentences.append(f"{method} corrected no trial with all sources together.")
            continue
        sentence = (
            f"{method} is left with {total.mean:.3g} mm ({total.low:.3g} to {total.high:.3g}) over "
            f"{len(total.cells)} cells"
        )
        if ranked:
            named = " and ".join(f"{source} ({100 * share:.0f} %)" for source, share in ranked[:2])
            sentence += f"; of the sources' squared contributions most come from {named}"
        sentences.append(sentence + ".")
    places = [f"{name} of {value:g} {unit} at the {share:.0f}th" for name, value, unit, share in
              percentiles(table)]  # fmt: skip
    if places:
        sentences.append(
            f"In the cells' distribution of the paper's method, its printed {', '.join(places)} "
            "percentile (its millimetres are compared with the lateral part)."
        )
    return " ".join(sentences)


def describe_budget(scenario: Scenario, budget: Budget) -> dict[str, Any]:
    """The study for machines: seed, draws, rows, percentiles, conclusion."""
    return {
        "schema": 1, "scenario": scenario.name, "seed": scenario.seed, "profile": scenario.profile,
        "draws": scenario.worlds, "conclusion": conclusion(budget.table, scenario.methods),
        "paper_percentiles": [
            {"figure": name, "value": value, "unit": unit, "percentile": share}
            for name, value, unit, share in percentiles(budget.table)
        ],
        "rows": as_rows(budget),
    }  # fmt: skip


def percentiles(table: Table) -> list[tuple[str, float, str, float]]:
    """The paper's printed figures: name, value, unit, share of the cells that lie below (%)."""
    found = []
    for name, value, quantity in PRINTED:
        estimate = table.get(("all", "", "paper", quantity))
        if estimate is not None:
            unit = quantity.rsplit("_", 1)[1]
            found.append((name, value, unit, percentile_of(value, estimate.cells)))
    return found
