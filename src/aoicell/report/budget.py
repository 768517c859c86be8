"""The error budget for the eye: table, stacked chart, the paper's place, one paragraph."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table as TextTable

from aoicell.benchmark.budget import Estimate, Table, percentile_of, shares
from aoicell.benchmark.sources import SOURCES
from aoicell.report import paper
from aoicell.report.style import METHOD_COLOURS, REFERENCE, new_figure

# the paper's millimetres are pixels times a scale: only the lateral part compares with them
PRINTED = (
    ("test 1", paper.TESTS[0].left_mm, "lateral_mm"),
    ("test 2", paper.TESTS[1].left_mm, "lateral_mm"),
    ("mean", paper.MEAN_MM, "lateral_mm"),
    ("mean", paper.MEAN_PX, "true_px"),
)


def budget_table(table: Table, methods: Sequence[str]) -> TextTable:
    """Each source alone and all but each, in mm and px, with 95 % confidence intervals."""
    text = TextTable(title="Error budget: mean residual over the drawn cells", title_justify="left")
    text.add_column("source", no_wrap=True)
    for method in methods:
        for column in ("alone mm", "alone px", "all but it mm"):
            text.add_column(f"{method}: {column}", justify="right")
    for source in SOURCES:
        row = [source]
        for method in methods:
            row += [
                _cell(table, ("alone", source, method, "residual_mm"), 3),
                _cell(table, ("alone", source, method, "true_px"), 2),
                _cell(table, ("without", source, method, "residual_mm"), 3),
            ]
        text.add_row(*row)
    text.add_section()
    total = ["all together"]
    for method in methods:
        total += [
            _cell(table, ("all", "", method, "residual_mm"), 3),
            _cell(table, ("all", "", method, "true_px"), 2),
            "",
        ]
    text.add_row(*total)
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
        total = table[("all", "", method, "residual_mm")].mean
        right.axvline(total, color=METHOD_COLOURS.get(method), linestyle="--", linewidth=1,
                      label=f"{method}, all together")  # fmt: skip
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
        cells = table[("all", "", "paper", quantity)].cells
        ax.ecdf(cells, color=METHOD_COLOURS["paper"], label="method paper, drawn cells")
        printed = [(name, value) for name, value, q in PRINTED if q == quantity]
        for index, (name, value) in enumerate(printed):
            share = percentile_of(value, cells)
            ax.axvline(value, color=REFERENCE, linestyle="--", linewidth=1)
            ax.annotate(
                f"paper {name} {value:g}: {share:.0f}th percentile", (value, 0.1 + 0.2 * index),
                xytext=(-4, 0), textcoords="offset points", fontsize=8, ha="right",
            )  # fmt: skip
        ax.set_xscale("log")
        ax.set_xlabel(label)
        ax.set_ylabel("share of cells")
        ax.grid(alpha=0.25, which="both")
    axes[0].legend(fontsize=8, loc="upper left")
    return figure


def conclusion(table: Table, methods: Sequence[str]) -> str:
    """One paragraph, written from the figures."""
    sentences = []
    for method in methods:
        total = table[("all", "", method, "residual_mm")]
        ranked = sorted(shares(table, method, "residual_mm").items(), key=lambda item: -item[1])
        named = " and ".join(f"{source} ({100 * share:.0f} %)" for source, share in ranked[:2])
        sentences.append(
            f"{method} is left with {total.mean:.2f} mm ({total.low:.2f} to {total.high:.2f}) over "
            f"{len(total.cells)} cells; most of its squared error comes from {named}."
        )
    if "paper" in methods:
        sentences.append(_verdict(table))
    return " ".join(sentences)


def _verdict(table: Table) -> str:
    cells: Estimate = table[("all", "", "paper", "lateral_mm")]
    share = percentile_of(paper.MEAN_MM, cells.cells)
    if share < 97.5:
        return f"The paper's {paper.MEAN_MM} mm lie at the {share:.0f}th percentile of the cells."
    largest = max(cells.cells)
    return (
        f"The paper's {paper.MEAN_MM} mm lie above {share:.0f} % of the cells (the largest has "
        f"{largest:.2f} mm lateral): with the stated tolerances, cross centres measured to a "
        "hundredth of a pixel and the equations carried out exactly, its procedure does better "
        "than its report. What these cells do not contain, corner detection to whole pixels, a "
        "wrong frame for R and t, or hand-placed references, has to explain the rest."
    )
