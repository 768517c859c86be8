"""The running chart of a line, and the page around it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from aoicell.benchmark.line.records import BoardRecord
from aoicell.benchmark.line.settings import LineSettings
from aoicell.benchmark.line.store import LineStore
from aoicell.benchmark.line.summary import summarise
from aoicell.benchmark.store import write_whole
from aoicell.report.page_axes import finish, log_scale
from aoicell.report.page_svg import inline_svg
from aoicell.report.style import METHOD_COLOURS, NEW, REFERENCE, new_figure, save
from aoicell.transforms import Array

_HERE = Path(__file__).parent
MOUNT, LIGHT = METHOD_COLOURS["aoicell"], "#E69F00"
VERDICTS = {"pass": "#009E73", "fail": "#D55E00", "no_verdict": "#999999"}
_ALARMS = {"warning": ("--", "#CC79A7"), "recalibrate": ("-", "#CC79A7")}
_LEAST = 1e-3  # of a limit: what is below has nothing to say


def write_line(store: LineStore) -> Path:
    """The chart (PNG, SVG, PDF) and the page of a line; the page's path."""
    settings, boards = store.settings(), store.boards()
    figure = line_chart(settings, boards)
    save(figure, store.folder / "line")
    page = _template().render(
        settings=settings, summary=summarise(settings, store), boards=boards,
        chart=inline_svg(line_chart(settings, boards), "line"),
        css=(_HERE / "page.css").read_text(), board=_board,
    )  # fmt: skip
    path = store.folder / "line.html"
    write_whole(path, page.encode())
    return path


def line_chart(settings: LineSettings, boards: Sequence[BoardRecord]) -> Figure:
    """Board by board: residuals and bounds, the drift monitor, what it comes to, verdicts."""
    figure = new_figure(11, 9)
    residuals, charts, used, verdicts = figure.subplots(
        4, 1, sharex=True, height_ratios=[3, 2.2, 2.2, 0.9]
    )
    numbers = np.array([board.number for board in boards])
    _residuals(residuals, settings, boards, numbers)
    _monitor(charts, boards, numbers)
    _used(used, settings, boards, numbers)
    _verdicts(verdicts, boards, numbers)
    for ax in (residuals, charts, used, verdicts):
        _events(ax, boards)
    verdicts.set_xlabel("board")
    verdicts.xaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def _residuals(
    ax: Axes, settings: LineSettings, boards: Sequence[BoardRecord], numbers: Array
) -> None:
    values = [[*board.residuals_mm.values()] for board in boards]
    worst = np.array([max(v, default=np.nan) for v in values])
    best = np.array([min(v, default=np.nan) for v in values])
    mean = _column(board.residual_mm for board in boards)
    ax.vlines(numbers, best, worst, color=MOUNT, alpha=0.4, linewidth=1.5)
    ax.plot(numbers, mean, "o", color=MOUNT, markersize=3.5, label="residual: mean, range of views")
    for name, style, label in (
        ("predicted_mm", ":", "predicted, 95 %"), ("bound_mm", "-", "predicted, 99.9 %"),
    ):  # fmt: skip
        ax.plot(
            numbers, _column(getattr(board, name) for board in boards), style, color=REFERENCE,
            linewidth=1, drawstyle="steps-mid", label=label,
        )  # fmt: skip
    ax.axhline(settings.tolerance_mm, color=NEW, linewidth=1, label="tolerance")
    ax.set_ylabel("left at the targets, mm")
    _finish(ax)


def _monitor(ax: Axes, boards: Sequence[BoardRecord], numbers: Array) -> None:
    for name, colour in (("mount", MOUNT), ("light", LIGHT)):
        values = _column(getattr(board.status, name) for board in boards)
        ax.plot(
            numbers, np.maximum(values, _LEAST), color=colour, marker=".", markersize=4,
            linewidth=1, label=name,
        )  # fmt: skip
    ax.axhline(1, color=REFERENCE, linewidth=1, label="limit of chance")
    ax.set_ylabel("drift chart / its limit")
    _finish(ax)


def _used(ax: Axes, settings: LineSettings, boards: Sequence[BoardRecord], numbers: Array) -> None:
    left = _column(board.status.left_mm / settings.tolerance_mm for board in boards)
    light = _column(abs(b.status.light_change) / settings.light_tolerance for b in boards)
    ax.plot(numbers, left, color=MOUNT, linewidth=1.2, label="mount, would leave at the targets")
    ax.plot(numbers, light, color=LIGHT, linewidth=1.2, label="light, changed")
    ax.axhline(settings.share, color=REFERENCE, linewidth=1, label="calibrate again")
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_ylim(bottom=0)
    ax.set_ylabel("share of the tolerance")
    _finish(ax, logarithmic=False)


def _verdicts(ax: Axes, boards: Sequence[BoardRecord], numbers: Array) -> None:
    for verdict, colour in VERDICTS.items():
        mine = np.array([board.verdict == verdict for board in boards])
        ax.bar(numbers[mine], 1, width=0.9, color=colour)
        ax.plot([], [], "s", color=colour, label=f"{verdict.replace('_', ' ')} ({mine.sum()})")
    wrong = np.array([board.is_wrong for board in boards])
    if wrong.any():
        ax.plot(numbers[wrong], np.full(wrong.sum(), 0.5), "kx", label=f"wrong ({wrong.sum()})")
    ax.set_yticks([])
    ax.set_ylabel("verdict")
    _finish(ax, logarithmic=False)


def _events(ax: Axes, boards: Sequence[BoardRecord]) -> None:
    """Alarms, and set-ups between two boards."""
    for board in boards:
        for alarm in board.alarms:
            style, colour = _ALARMS[alarm.level]
            ax.axvline(board.number, color=colour, linestyle=style, linewidth=1, zorder=0)
        if board.set_up_next:
            ax.axvline(board.number + 0.5, color="black", linestyle=":", linewidth=1.2, zorder=0)


def _finish(ax: Axes, logarithmic: bool = True) -> None:
    if logarithmic:
        log_scale(ax, "y")
    finish(ax, "y")
    handles, _ = ax.get_legend_handles_labels()
    if handles:
        ax.legend(fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _column(values: Any) -> Array:
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def _board(number: int | None) -> str:
    return "none" if number is None else f"board {number}"


def _template() -> Template:
    environment = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template("line.html.jinja")
