"""The error budget for the eye: table, stacked chart, the paper's place, one paragraph."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from rich.box import SIMPLE
from rich.table import Table as TextTable

from aoicell.benchmark.budget import Budget, Table, as_rows, percentile_of, shares
from aoicell.report import paper
from aoicell.report.style import METHOD_COLOURS, STANDARD, new_figure
from aoicell.scenario import Scenario
from aoicell.sim.sources import SOURCES


@dataclass(frozen=True)
class Printed:
    """A figure that the paper prints, and what it is to be compared with.

    Its two tests are set against single tests (`among` "tests"), its means over both against
    the means of the cells ("cells"). Its millimetres are pixels times a scale: only the lateral
    part compares with them.
    """

    name: str
    value: float
    quantity: str
    among: str

    @property
    def unit(self) -> str:
        """The unit that the quantity ends on, mm or px."""
        return self.quantity.rsplit("_", 1)[1]

    def __str__(self) -> str:
        return f"{self.name} of {self.value:.2f} {self.unit}"


PRINTED = (
    Printed("test 1", paper.TESTS[0].left_mm, "lateral_mm", "tests"),
    Printed("test 2", paper.TESTS[1].left_mm, "lateral_mm", "tests"),
    Printed("mean", paper.MEAN_MM, "lateral_mm", "cells"),
    Printed("mean", paper.MEAN_PX, "true_px", "cells"),
)
AMONG = {"tests": ("single tests", METHOD_COLOURS["paper"]), "cells": ("cells' means", STANDARD)}
COLOURS = dict(zip(SOURCES, [*(f"C{i}" for i in range(10)), "#333333"], strict=True))
LABELLED = 0.06  # smallest share that is written into its bar


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
    """A stacked bar of contributions for each method in mm and px, and each source alone."""
    figure = new_figure(13, 5.6)
    grid = figure.add_gridspec(1, 2, width_ratios=[1, 1.1])
    stacks, alone = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
    bars = [(method, quantity) for method in methods for quantity in ("residual_mm", "true_px")]
    axes = stacks.subplots(1, len(bars), squeeze=False)[0]
    for ax, (method, quantity) in zip(axes, bars, strict=True):
        _stack(ax, table, method, quantity)
    stacks.suptitle(
        "Mean residual with all sources, ± 95 % confidence.\n"
        "A source's height: its share of the squared contributions, each alone, times the mean",
        fontsize=9,
    )
    _alone(alone.subplots(), table, methods)
    alone.suptitle("Each source alone, 95 % confidence", fontsize=9)
    figure.legend(
        handles=[Patch(color=colour, label=source) for source, colour in COLOURS.items()],
        loc="outside lower center", ncols=6, fontsize=8, frameon=False,
    )  # fmt: skip
    return figure


def _stack(ax: Axes, table: Table, method: str, quantity: str) -> None:
    """The all-together mean, divided as the sources' squared contributions are."""
    unit = quantity.rsplit("_", 1)[1]
    ax.set_title(f"{method}, {unit}", fontsize=9, color=METHOD_COLOURS.get(method))
    ax.set_xticks([])
    ax.set_xlim(-0.7, 0.7)
    everything = table.get(("all", "", method, quantity))
    if everything is None:
        ax.set_yticks([])
        return
    bottom = 0.0
    for source, share in shares(table, method, quantity).items():
        height = share * everything.mean
        ax.bar(0, height, bottom=bottom, color=COLOURS[source], width=0.8)
        if share > LABELLED:
            ax.annotate(f"{100 * share:.0f} %", (0, bottom + height / 2), fontsize=8,
                        ha="center", va="center", color="white")  # fmt: skip
        bottom += height
    ax.errorbar(
        0, everything.mean, fmt="none", ecolor="black", capsize=6,
        yerr=[[everything.mean - everything.low], [everything.high - everything.mean]],
    )  # fmt: skip
    ax.set_ylim(0, 1.05 * everything.high)


def _alone(ax: Axes, table: Table, methods: Sequence[str]) -> None:
    """Mean residual of each source alone, with its confidence interval, for all methods."""
    positions = np.arange(len(SOURCES))
    for offset, method in zip(np.linspace(-0.18, 0.18, len(methods)), methods, strict=True):
        colour = METHOD_COLOURS.get(method)
        found = [table.get(("alone", source, method, "residual_mm")) for source in SOURCES]
        mean = np.array([e.mean if e else np.nan for e in found])
        low = np.array([e.mean - e.low if e else np.nan for e in found])
        high = np.array([e.high - e.mean if e else np.nan for e in found])
        ax.errorbar(
            mean, positions + offset, xerr=[low, high], fmt="o", markersize=5, capsize=3,
            color=colour, label=f"{method}, source alone",
        )  # fmt: skip
        everything = table.get(("all", "", method, "residual_mm"))
        if everything is not None:
            ax.axvline(everything.mean, color=colour, linestyle="--", linewidth=1,
                       label=f"{method}, all together")  # fmt: skip
    ax.set_yticks(positions, list(SOURCES))
    ax.invert_yaxis()
    ax.set_xscale("symlog", linthresh=1e-2)
    ax.set_xlim(left=0)
    ax.set_xlabel("mean residual, mm")
    ax.grid(axis="x", alpha=0.3, which="both")
    ax.legend(fontsize=8)


def reproduction_chart(table: Table) -> Figure:
    """Where the paper's printed figures fall among single tests and among means of the cells."""
    figure = new_figure(12, 4.6)
    axes = figure.subplots(1, 2)
    panels = (("lateral_mm", "lateral residual, mm"), ("true_px", "distance of the markers, px"))
    for ax, (quantity, label) in zip(axes, panels, strict=True):
        everything = table.get(("all", "", "paper", quantity))
        if everything is None:
            continue
        for among, (name, colour) in AMONG.items():
            ax.ecdf(getattr(everything, among), color=colour, label=name)
        here = [(p, share) for p, share in percentiles(table) if p.quantity == quantity]
        for (printed, share), style in zip(here, ("--", ":", "-."), strict=False):
            name, colour = AMONG[printed.among]
            ax.axvline(
                printed.value, color=colour, linestyle=style, linewidth=1.2,
                label=f"the paper's {printed}: percentile {share:.0f} of {name}",
            )  # fmt: skip
            ax.plot(printed.value, share / 100, "o", color=colour, markersize=5)
        ax.set_xlim(left=0)
        ax.set_xlabel(label)
        ax.set_ylabel("share below")
        ax.grid(alpha=0.25, which="both")
        ax.legend(fontsize=8, loc="lower right", framealpha=1)
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
    return " ".join([*sentences, *_reproduction(table)])


def _reproduction(table: Table) -> list[str]:
    """Where the paper's printed figures fall, in words."""
    found = percentiles(table)
    if not found:
        return []
    places = [f"{p} at percentile {share:.0f} of the {AMONG[p.among][0]}" for p, share in found]
    sentences = [
        f"Of the drawn cells with the paper's method its printed figures stand thus: "
        f"{', '.join(places)} (its millimetres are compared with the lateral part)."
    ]
    for printed, share in found:
        if share in (0, 100):
            left = "less" if share == 100 else "more"
            sentences.append(
                f"The {printed} lies outside: each of the {AMONG[printed.among][0]} leaves {left}."
            )
    return sentences


def describe_budget(scenario: Scenario, budget: Budget) -> dict[str, Any]:
    """The study for machines: seed, draws, rows, percentiles, conclusion."""
    return {
        "schema": 1, "scenario": scenario.name, "seed": scenario.seed, "profile": scenario.profile,
        "draws": scenario.worlds, "conclusion": conclusion(budget.table, scenario.methods),
        "paper_percentiles": [
            {"figure": p.name, "value": p.value, "unit": p.unit, "among": p.among,
             "percentile": share}
            for p, share in percentiles(budget.table)
        ],
        "rows": as_rows(budget),
    }  # fmt: skip


def percentiles(table: Table) -> list[tuple[Printed, float]]:
    """The paper's printed figures, each with the share (%) of its distribution that lies below."""
    found = []
    for printed in PRINTED:
        estimate = table.get(("all", "", "paper", printed.quantity))
        if estimate is not None:
            share = percentile_of(printed.value, getattr(estimate, printed.among))
            found.append((printed, share))
    return found
