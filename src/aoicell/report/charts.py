"""The paper's Figures 20 and 21: distance error of each view and marker, in px and in mm."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.store import Columns
from aoicell.report import paper
from aoicell.report.style import METHOD_COLOURS, REFERENCE, new_figure

_MARKS = "os^Dvp"


def distance_errors(trials: Sequence[TrialRecord], floor_mm: float | None) -> Figure:
    """Two panels, px and mm; one line a method and test, the paper's mean dashed."""
    figure = new_figure(11, 4.6)
    axes = figure.subplots(1, 2)
    panels = (("detected_px", "px", paper.MEAN_PX), ("image_mm", "mm", paper.MEAN_MM))
    for ax, (quantity, unit, printed) in zip(axes, panels, strict=True):
        for trial in trials:
            _line(ax, trial, quantity)
        ax.axhline(printed, color=REFERENCE, linestyle="--", linewidth=1)
        ax.annotate(
            f"paper's mean, {printed} {unit}", (0.01, printed), xycoords=("axes fraction", "data"),
            xytext=(0, 4), textcoords="offset points", color=REFERENCE, fontsize=8,
        )  # fmt: skip
        ax.set_yscale("log")
        ax.set_ylabel(f"distance of the marker's crosses, {unit}")
        ax.grid(axis="y", which="both", alpha=0.25)
        ax.tick_params(axis="x", rotation=30)
    if floor_mm:
        axes[1].axhline(floor_mm, color="black", linestyle=":", linewidth=1)
        axes[1].annotate(
            "two arrivals of the arm", (0.01, floor_mm), xycoords=("axes fraction", "data"),
            xytext=(0, 4), textcoords="offset points", fontsize=8,
        )  # fmt: skip
    axes[0].set_title("Standard against new image, px (Figure 20)", fontsize=10)
    axes[1].set_title("The same in mm on the board (Figure 21)", fontsize=10)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=9, frameon=False)
    return figure


def _line(ax: Axes, trial: TrialRecord, quantity: str) -> None:
    points = [
        (f"{view.id} {marker.id}", getattr(marker, quantity))
        for view in trial.views
        for marker in view.markers
        if getattr(marker, quantity) is not None
    ]
    if points:
        ax.plot(
            [name for name, _ in points], [value for _, value in points],
            color=METHOD_COLOURS.get(trial.method), marker=_MARKS[trial.trial % len(_MARKS)],
            linestyle="-" if trial.trial == 0 else "--", linewidth=1.2, markersize=5,
            label=f"{trial.method}, test {trial.trial + 1}",
        )  # fmt: skip


def residual_distribution(trials: Columns, floor_mm: float | None) -> Figure:
    """For many trials: the share of trials below a residual, one curve a method."""
    figure = new_figure(6.4, 4.2)
    ax = figure.subplots()
    for method in sorted(set(trials["method"])):
        values = trials["residual_mm"][trials["method"] == method]
        values = values[np.isfinite(values)]
        if len(values):
            ax.ecdf(values, color=METHOD_COLOURS.get(method), label=method)
    if floor_mm:
        ax.axvline(floor_mm, color="black", linestyle=":", linewidth=1, label="arm's floor")
    ax.axvline(paper.MEAN_MM, color=REFERENCE, linestyle="--", linewidth=1, label="paper's mean")
    ax.set_xscale("log")
    ax.set_xlabel("mean residual of a trial, mm")
    ax.set_ylabel("share of trials")
    ax.grid(alpha=0.25, which="both")
    ax.legend(fontsize=9)
    return figure
