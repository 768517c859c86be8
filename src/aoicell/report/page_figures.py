"""The figures of the page: distributions, residual against what was done, directions, cases."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from aoicell.benchmark.store import Columns
from aoicell.report import paper
from aoicell.report.page_axes import finish, legend_below, log_scale
from aoicell.report.page_data import RunData, case_name, choose
from aoicell.report.style import REFERENCE, colours_of, new_figure

MANY_POINTS = 1000  # a cloud of more is a picture within the figure
MANY_CASES = 60  # more have numbers instead of names
LEAST_MM = 1e-3  # what is below has no meaning in a cell: drawn there
_SIZE = (5.6, 3.7)
MARKERS = "osD^v<>ph"
_BINS, _ENOUGH = 12, 60  # of a running median, and how many points it wants


@dataclass(frozen=True)
class Drawing:
    """A figure with its place (`name` is its file's, too), title and caption."""

    name: str
    title: str
    caption: str
    figure: Figure
    wide: bool = False


def distributions(run: RunData) -> Iterator[Drawing]:
    """Shares of trials below a residual: from truth, and as the paper measures it."""
    if not np.isfinite(run.shown["residual_mm"]).any():
        return
    least, most = run.tolerances_mm
    lines = [(least, "tolerance", "-")] if least == most else []
    floor = [(run.arm_floor_mm, "arm alone", ":")] if run.arm_floor_mm else []
    yield Drawing(
        "residual_distribution", "What is left, from truth",
        "Share of trials whose mean residual over the views lies below a value. Arm alone: how far "
        "two arrivals at the same target lie apart.",
        _ecdf(run, "residual_mm", "residual, mm", floor + lines),
    )  # fmt: skip
    if np.isfinite(run.shown["image_mm"]).any():
        first, second = paper.TESTS
        printed = [
            (paper.MEAN_MM, "paper, mean", "--"), (first.left_mm, "paper, test 1", "-."),
            (second.left_mm, "paper, test 2", ":"),
        ]  # fmt: skip
        yield Drawing(
            "picture_distribution", "The same as the paper measures it",
            "Distance of the markers between the two pictures, in pixels times the local scale: "
            "depth hardly shows in it. The lines are the paper's figures as printed.",
            _ecdf(run, "image_mm", "distance in the pictures, mm", printed),
        )  # fmt: skip


def _ecdf(run: RunData, column: str, label: str, lines: list[tuple[float, str, str]]) -> Figure:
    figure = new_figure(*_SIZE)
    ax = figure.subplots()
    for method, colour, mine in _by_method(run):
        values = mine[column][np.isfinite(mine[column])]
        if len(values):
            ax.ecdf(values, color=colour, label=method, linewidth=1.8)
    for value, name, style in lines:
        ax.axvline(value, color=REFERENCE, linestyle=style, linewidth=1, label=name)
    log_scale(ax, "x")
    ax.set_xlabel(label)
    ax.set_ylabel("share of trials")
    finish(ax)
    legend_below(figure, ax)
    return figure


def against_motion(run: RunData) -> Iterator[Drawing]:
    """Residual against displacement and against rotation, with refused trials at the edge."""
    for column, name, label in (
        ("displacement_mm", "displacement", "displacement, mm"),
        ("turn_deg", "rotation", "rotation of the board, deg"),
    ):
        yield Drawing(
            f"residual_against_{name}", f"Residual against {name}",
            "One point a trial; from 60 trials on with a running median. Ticks at the upper edge: "
            "trials that were refused or failed.",
            _against(run, column, label),
        )  # fmt: skip


def _against(run: RunData, column: str, label: str) -> Figure:
    figure = new_figure(*_SIZE)
    ax = figure.subplots()
    cloud = len(run.shown["number"]) > MANY_POINTS
    methods = list(_by_method(run))
    for index, (method, colour, mine) in enumerate(methods):
        x, y = mine[column], mine["residual_mm"]
        known = np.isfinite(y)
        ax.plot(
            x[known], y[known], linestyle="", marker=MARKERS[index % len(MARKERS)],
            color=colour, markersize=2 if cloud else 4.5, alpha=0.25 if cloud else 0.75,
            markeredgewidth=0, rasterized=cloud, label=method,
        )  # fmt: skip
        if known.sum() >= _ENOUGH:
            ax.plot(*_running_median(x[known], y[known]), color=colour, linewidth=2)
        height = 1.03 + 0.03 * (len(methods) - 1 - index)
        # (the board of a cell that could not be calibrated was never moved)
        ended = ~known & (mine["displacement_mm"] > 0)
        if ended.any():
            ax.plot(
                x[ended], np.full(ended.sum(), height), linestyle="", marker="|", color=colour,
                markersize=6, transform=ax.get_xaxis_transform(), clip_on=False, rasterized=cloud,
            )  # fmt: skip
    log_scale(ax, "y")
    ax.set_xlabel(label)
    ax.set_ylabel("residual, mm")
    finish(ax)
    legend_below(figure, ax)
    return figure


def _running_median(
    x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[list[float], list[float]]:
    """Medians of bins with equally many points."""
    bins = np.array_split(np.argsort(x, kind="stable"), _BINS)
    return [float(np.median(x[b])) for b in bins], [float(np.median(y[b])) for b in bins]


def directions(run: RunData) -> Iterator[Drawing]:
    """Signed mean residual vectors by axis, one figure a method, for their sizes differ."""
    axes = (("x_mm", "x", "#CC79A7", "o"), ("y_mm", "y", "#009E73", "s"),
            ("z_mm", "z (depth)", "#E69F00", "D"))  # fmt: skip
    for method in run.scenario.methods:
        mine = choose(run.views, run.views["method"] == method)
        if not len(mine["view"]):
            continue
        views = sorted(set(mine["view"]))
        figure = new_figure(_SIZE[0], 1.5 + 0.45 * len(views))
        ax = figure.subplots()
        ax.axvline(0, color=REFERENCE, linewidth=0.8)
        for offset, (column, name, colour, mark) in zip((-0.22, 0, 0.22), axes, strict=True):
            values = [mine[column][mine["view"] == view] for view in views]
            mean = np.array([v.mean() for v in values])
            low, high = np.array([np.percentile(v, [5, 95]) for v in values]).T
            rows = np.arange(len(views)) + offset
            ax.hlines(rows, low, high, color=colour, linewidth=1.5)
            ax.plot(mean, rows, mark, color=colour, markersize=5, label=name)
        ax.set_yticks(range(len(views)), views, parse_math=False)
        ax.set_ylim(len(views) - 0.5, -0.5)
        ax.set_xlabel("signed mean residual, mm")
        finish(ax, "x")
        legend_below(figure, ax)
        yield Drawing(
            f"directions_{method}", f"Direction of what {method} leaves",
            "Mean over the trials (mark) and the middle 90 % of them (line), in the camera's axes: "
            "x to the right, y down, z along the optical axis.",
            figure,
        )  # fmt: skip


def prediction(run: RunData) -> Iterator[Drawing]:
    """Predicted against actual error, where a method states one."""
    known = (run.shown["predicted_mm"] > 0) & (run.shown["residual_mm"] > 0)  # not NaN
    if not known.any():
        return
    figure = new_figure(*_SIZE)
    ax = figure.subplots()
    shown = choose(run.shown, known)
    cloud = len(shown["number"]) > MANY_POINTS
    for method, colour, mine in _by_method(run, shown):
        if len(mine["number"]):
            ax.plot(
                mine["predicted_mm"], mine["residual_mm"], ".", color=colour, label=method,
                alpha=0.3 if cloud else 0.75, rasterized=cloud,
            )  # fmt: skip
    both = np.concatenate([shown["predicted_mm"], shown["residual_mm"]])
    ends = [both.min(), both.max()]
    ax.plot(ends, ends, color=REFERENCE, linewidth=1, label="as predicted")
    log_scale(ax, "x")
    log_scale(ax, "y")
    ax.set_xlabel("predicted by the method, mm")
    ax.set_ylabel("residual, mm")
    finish(ax)
    legend_below(figure, ax)
    yield Drawing(
        "predicted_against_actual", "Predicted against actual error",
        "One point a trial; above the line more is left than the method expected.", figure,
    )  # fmt: skip


def by_case(run: RunData) -> Iterator[Drawing]:
    """Mean and 95th percentile of the residual, case by case."""
    if len(run.cases) < 2:
        return
    count, named = len(run.cases), len(run.cases) <= MANY_CASES
    figure = new_figure(11, 1.3 + min(0.3 * count, 14))
    ax = figure.subplots()
    colours, methods = colours_of(run.scenario.methods), run.scenario.methods
    for index, (offset, method) in enumerate(
        zip(np.linspace(-0.15, 0.15, len(methods)), methods, strict=True)
    ):
        found = [case["methods"][method]["residual_mm"] for case in run.by_case]
        mean, p95 = (
            np.maximum([np.nan if s[k] is None else s[k] for s in found], LEAST_MM)
            for k in ("mean", "p95")
        )
        rows = np.arange(count) + offset
        ax.hlines(rows, mean, p95, color=colours[method], linewidth=1.5)
        ax.plot(mean, rows, MARKERS[index % len(MARKERS)], color=colours[method],
                markersize=5 if named else 3, label=method)  # fmt: skip
    if named:
        names = [case_name(case) for case in run.cases]
        ax.set_yticks(range(count), names, parse_math=False)
    else:
        ax.set_ylabel("number of the case")
    ax.set_ylim(count - 0.4, -0.6)
    log_scale(ax, "x")
    ax.set_xlabel("residual, mm: mean (mark) to 95th percentile (end of the line)")
    finish(ax, "x")
    legend_below(figure, ax)
    yield Drawing(
        "residual_by_case", "Residual, case by case",
        "Values below 0.001 mm stand there. A case without a mark has no corrected trial.",
        figure, True,
    )  # fmt: skip


# -- What all share ---------------------------------------------------------------------


def _by_method(run: RunData, trials: Columns | None = None) -> Iterator[tuple[str, str, Columns]]:
    """Each method with its colour and its rows of the shown trials."""
    shown, colours = run.shown if trials is None else trials, colours_of(run.scenario.methods)
    for method in run.scenario.methods:
        yield method, colours[method], choose(shown, shown["method"] == method)
