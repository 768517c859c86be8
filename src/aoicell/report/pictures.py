"""The paper's Figures 14 and 16-19: standard images, and what the new ones show beside them."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import fill

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from aoicell.benchmark.records import MarkerRecord, TrialRecord, ViewRecord
from aoicell.benchmark.values import view_values
from aoicell.errors import InputError
from aoicell.report.style import NEW, STANDARD, new_figure

Picture = NDArray[np.uint8]
MAGNIFICATIONS = (1, 2, 5, 10, 20, 50, 100, 200)  # of the offsets, so that they can be seen


def _read(path: Path) -> Picture:
    image = cv2.imread(str(path))
    if image is None:
        raise InputError(f"{path}: not a readable picture; run the scenario again")
    return np.asarray(image[:, :, ::-1], dtype=np.uint8)


def standard_images(paths: dict[str, Path]) -> Figure:
    """The standard image of each view, in a grid."""
    figure = new_figure(9, 3.5 * ((len(paths) + 1) // 2))
    axes = figure.subplots((len(paths) + 1) // 2, 2, squeeze=False).ravel()
    for ax, (view, path) in zip(axes, paths.items(), strict=False):
        _show(ax, _read(path), f"{view}, standard image")
    for ax in axes[len(paths) :]:
        ax.axis("off")
    return figure


def view_comparison(view: str, standard: Path, new: Sequence[tuple[TrialRecord, Path]]) -> Figure:
    """One view: the standard image, then each test's new image; one row a method.

    On the new image the crosses as they are (circles) and where they were in the standard
    image (plus signs); in the inset the offsets between them, magnified alike in all panels.
    """
    methods = list(dict.fromkeys(trial.method for trial, _ in new))
    tests = sorted({trial.trial for trial, _ in new})
    records = {id(t): r for t, _ in new for r in t.views if r.id == view}
    magnify = magnification(marker for record in records.values() for marker in record.markers)
    figure = new_figure(4.2 * (1 + len(tests)), 3.5 * len(methods) + 0.4)
    axes = figure.subplots(len(methods), 1 + len(tests), squeeze=False)
    first = _read(standard)
    for row in axes:
        _show(row[0], first, f"{view}, standard image")
        for ax in row[1:]:
            ax.axis("off")
    for trial, path in new:
        ax = axes[methods.index(trial.method)][1 + tests.index(trial.trial)]
        record = records.get(id(trial))
        if record is None or not path.is_file():
            _show_missing(ax, first.shape, trial)
        else:
            _show_new(ax, _read(path), _caption(trial, record), record.markers, magnify)
    _legend(figure, magnify)
    return figure


def magnification(markers: Iterable[MarkerRecord]) -> int:
    """How much longer than true to draw offsets: the longest under 0.4 of the crosses' distance."""
    ratios = [1.0 / MAGNIFICATIONS[-1]]
    for marker in markers:
        if marker.standard_uv_px is not None and marker.new_uv_px is not None:
            before, after = np.array(marker.standard_uv_px), np.array(marker.new_uv_px)
            longest = float(np.linalg.norm(after - before, axis=1).max())
            ratios.append(longest / (0.4 * float(np.linalg.norm(before[1] - before[0])) + 1e-9))
    return max((m for m in MAGNIFICATIONS if m * max(ratios) <= 1), default=1)


def _legend(figure: Figure, magnify: int) -> None:
    def mark(symbol: str, colour: str, label: str) -> Line2D:
        return Line2D(
            [], [], linestyle="", marker=symbol, color=colour, label=label, fillstyle="none"
        )

    offset = f"offset in the inset, {magnify} times its length"
    handles = [
        mark("+", STANDARD, "cross in the standard image"),
        mark("o", NEW, "cross in the new image"),
        Line2D([], [], color=NEW, label=offset),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=9)


def _caption(trial: TrialRecord, view: ViewRecord) -> str:
    values = view_values(view)
    px, mm = values["detected_px"], values["image_mm"]
    seen = "no marker detected" if px is None or mm is None else f"{px:.2f} px, {mm:.3f} mm"
    return f"{trial.method}, test {trial.trial + 1}: {seen}"


def _show(ax: Axes, image: Picture, title: str) -> None:
    height, width = image.shape[:2]
    scale = min(1.0, 600 / width)  # about the pixels of a panel: more cost time and show nothing
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    ax.imshow(small, extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    ax.set_title(title, fontsize=9)
    ax.axis("off")


def _show_missing(ax: Axes, shape: tuple[int, ...], trial: TrialRecord) -> None:
    """An empty panel that says why there is no picture."""
    height, width = shape[:2]
    ax.set(xlim=(0, width), ylim=(height, 0), aspect="equal")
    ax.set_title(f"{trial.method}, test {trial.trial + 1}: {trial.outcome}", fontsize=9)
    reason = fill(trial.reason or "no picture was kept", 40)
    ax.text(width / 2, height / 2, reason, ha="center", va="center", fontsize=9, parse_math=False)


def _show_new(
    ax: Axes, image: Picture, title: str, markers: Sequence[MarkerRecord], magnify: int
) -> None:
    _show(ax, image, title)
    known = [m for m in markers if m.standard_uv_px is not None and m.new_uv_px is not None]
    for marker in known:
        _draw_crosses(ax, marker)
    if known:
        _draw_inset(ax, image, known[0], magnify)


def _draw_inset(ax: Axes, image: Picture, marker: MarkerRecord, magnify: int) -> None:
    """A marker enlarged and paled, in the corner that lies opposite to it."""
    crosses = np.array(marker.new_uv_px)
    size = np.array(image.shape[1::-1])
    centre, half = crosses.mean(axis=0), 0.95 * float(np.ptp(crosses, axis=0).max())
    low = np.maximum(centre - half, 0).astype(int)
    high = np.minimum(centre + half, size).astype(int)
    left, above = centre < size / 2
    inset = ax.inset_axes((0.63 if left else 0.01, 0.02 if above else 0.50, 0.36, 0.48))
    pale = 150 + 0.41 * image[low[1] : high[1], low[0] : high[0]]
    extent = (low[0] - 0.5, high[0] - 0.5, high[1] - 0.5, low[1] - 0.5)
    inset.imshow(pale.astype(np.uint8), extent=extent)
    inset.set(xticks=[], yticks=[], xlim=extent[:2], ylim=extent[2:])
    before = np.array(marker.standard_uv_px)
    for start, offset in zip(before, magnify * (crosses - before), strict=True):
        inset.annotate(
            "", start + offset, start,
            arrowprops={
                "arrowstyle": "->", "color": NEW, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0,
                "mutation_scale": 7,
            },
            annotation_clip=False,
        )  # fmt: skip
    inset.plot(*before.T, linestyle="", marker="+", color=STANDARD, markersize=9)


def _draw_crosses(ax: Axes, marker: MarkerRecord) -> None:
    before, after = np.array(marker.standard_uv_px), np.array(marker.new_uv_px)
    ax.plot(*before.T, linestyle="", marker="+", color=STANDARD, markersize=8)
    ax.plot(*after.T, linestyle="", marker="o", color=NEW, markersize=6, fillstyle="none")
    ax.annotate(
        marker.id, before.mean(axis=0), ha="center", va="center", fontsize=8, fontweight="bold"
    )
