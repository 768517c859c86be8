"""The figures of a run that inspects: defects found, shifts measured, pictures registered."""

from collections.abc import Iterator, Sequence

import numpy as np

from aoicell.report.inspection_data import InspectionData
from aoicell.report.inspection_numbers import REGISTRATION_PX, SHIFT_MM, binomial_interval, words
from aoicell.report.page_axes import finish, legend_below, log_scale
from aoicell.report.page_data import RunData
from aoicell.report.page_figures import LEAST_MM, MANY_POINTS, MARKERS, Drawing
from aoicell.report.style import REFERENCE, colours_of, new_figure

_SIZE = (5.6, 3.7)


def inspection_figures(run: RunData, inspection: InspectionData) -> Iterator[Drawing]:
    """Every figure that there is something to draw for."""
    yield from _by_defect(run, inspection)
    yield from _shifts(run, inspection)
    yield from _registration(run, inspection)


def _around(values: Sequence[float], asked: float) -> tuple[float, float]:
    """Ends of a logarithmic axis that has all values and what is asked for."""
    positive = [value for value in values if value > 0]
    return 0.7 * min([*positive, asked]), 1.4 * max([*positive, asked])


def _by_defect(run: RunData, inspection: InspectionData) -> Iterator[Drawing]:
    kinds = sorted({kind for i in inspection.methods.values() for kind in i["by_kind"]})
    if not kinds:
        return
    figure = new_figure(_SIZE[0], 1.5 + 0.42 * len(kinds))
    ax = figure.subplots()
    methods, colours = run.scenario.methods, colours_of(run.scenario.methods)
    for index, method in enumerate(methods):
        found = inspection.methods[method]["by_kind"]
        here = [row for row, kind in enumerate(kinds) if kind in found]
        counts = [(found[kinds[row]]["found"], found[kinds[row]]["defects"]) for row in here]
        at = np.array(here) + 0.2 * (index - (len(methods) - 1) / 2)
        ends = np.array([binomial_interval(*pair) for pair in counts]).reshape(-1, 2)
        ax.hlines(at, *(100 * ends.T), color=colours[method], linewidth=1.5)
        ax.plot(
            [100 * count / of for count, of in counts], at, MARKERS[index % len(MARKERS)],
            color=colours[method], markersize=5, label=method, clip_on=False,
        )  # fmt: skip
    ax.set_yticks(range(len(kinds)), [words(kind) for kind in kinds])
    ax.set_ylim(len(kinds) - 0.4, -0.6)
    ax.set_xlim(-2, 102)
    ax.set_xlabel("defects found, %")
    finish(ax, "x")
    legend_below(figure, ax)
    yield Drawing(
        "detection_by_defect", "Defects found, by kind",
        "The share of the planted defects that was found (mark) and its 95 % interval (line).",
        figure,
    )  # fmt: skip


def _shifts(run: RunData, inspection: InspectionData) -> Iterator[Drawing]:
    measured = [p for p in inspection.parts if p.record.shift_error_mm is not None]
    if not measured:
        return
    figure = new_figure(*_SIZE)
    ax = figure.subplots()
    colours, cloud = colours_of(run.scenario.methods), len(measured) > MANY_POINTS
    for index, method in enumerate(run.scenario.methods):
        mine = [part.record for part in measured if part.key.method == method]
        if mine:
            errors = [max(record.shift_error_mm or 0.0, LEAST_MM) for record in mine]
            ax.plot(
                [record.shift_mm for record in mine], errors, MARKERS[index % len(MARKERS)],
                color=colours[method], markersize=2.5 if cloud else 4.5, markeredgewidth=0,
                alpha=0.35 if cloud else 0.75, rasterized=cloud, label=method,
            )  # fmt: skip
    ax.axhline(SHIFT_MM, color=REFERENCE, linewidth=1, label=f"{SHIFT_MM:g} mm")
    ax.set_ylim(*_around([max(p.record.shift_error_mm or 0, LEAST_MM) for p in measured], SHIFT_MM))
    log_scale(ax, "y")
    ax.set_xlabel("true shift, mm")
    ax.set_ylabel("error of the measured shift, mm")
    finish(ax)
    legend_below(figure, ax)
    yield Drawing(
        "shift_error", "Measured against true shift",
        "One point a shifted part whose shift was measured: how far the measured shift lies from "
        "the true one.",
        figure,
    )  # fmt: skip


def _registration(run: RunData, inspection: InspectionData) -> Iterator[Drawing]:
    table = inspection.registrations
    known = np.isfinite(table["error_px"]) & (table["state"] != "no_verdict")
    if not known.any():
        return
    figure = new_figure(*_SIZE)
    ax = figure.subplots()
    colours = colours_of(run.scenario.methods)
    for method in run.scenario.methods:
        mine = table["error_px"][known & (table["method"] == method)]
        if len(mine):
            ax.ecdf(mine, color=colours[method], label=method, linewidth=1.8)
    ax.axvline(REGISTRATION_PX, color=REFERENCE, linewidth=1, label=f"{REGISTRATION_PX:g} px")
    ax.set_xlim(*_around(table["error_px"][known], REGISTRATION_PX))
    log_scale(ax, "x")
    ax.set_xlabel("registration error, px")
    ax.set_ylabel("share of views")
    finish(ax)
    legend_below(figure, ax)
    yield Drawing(
        "registration_error", "Registration of the pictures",
        "Share of views in which points of the reference were found again within a distance, by "
        "the truth. Views that the inspection itself gave up are left out.",
        figure,
    )  # fmt: skip
