"""The paper's Figures 14 and 16-19: standard images, and what the new ones show beside them."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from aoicell.benchmark.records import MarkerRecord, TrialRecord, ViewRecord
from aoicell.errors import InputError
from aoicell.report.style import NEW, STANDARD, new_figure

Picture = NDArray[np.uint8]
MAGNIFY = 20  # how much longer than true the marker offsets are drawn


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


def view_comparison(
    view: str, standard: Path, new: Sequence[tuple[TrialRecord, ViewRecord, Path]]
) -> Figure:
    """One view: the standard image, then each test's new image; one row a method.

    On the new image the crosses as they are (circles) and where they were in the standard
    image (plus signs), with the offset between them drawn larger than true.
    """
    methods = list(dict.fromkeys(trial.method for trial, _, _ in new))
    tests = sorted({trial.trial for trial, _, _ in new})
    figure = new_figure(4.2 * (1 + len(tests)), 3.5 * len(methods) + 0.4)
    axes = figure.subplots(len(methods), 1 + len(tests), squeeze=False)
    for row, method in enumerate(methods):
        _show(axes[row][0], _read(standard), f"{view}, standard image")
        for ax in axes[row][1:]:
            ax.axis("off")
        for trial, record, path in new:
            if trial.method == method:
                ax = axes[row][1 + tests.index(trial.trial)]
                _show(ax, _read(path), _caption(trial, record))
                _draw_offsets(ax, record.markers)
                _draw_inset(ax, _read(path), record.markers)
    figure.supxlabel(
        f"circles: crosses in the new image; plus: in the standard image; lines: the offset, "
        f"{MAGNIFY} times its length",
        fontsize=9,
    )
    return figure


def _caption(trial: TrialRecord, view: ViewRecord) -> str:
    known = [m for m in view.markers if m.detected_px is not None and m.image_mm is not None]
    px = np.mean([m.detected_px for m in known if m.detected_px is not None]) if known else np.nan
    mm = np.mean([m.image_mm for m in known if m.image_mm is not None]) if known else np.nan
    return f"{trial.method}, test {trial.trial + 1}: {px:.2f} px, {mm:.3f} mm"


def _show(ax: Axes, image: Picture, title: str) -> None:
    height, width = image.shape[:2]
    small = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    ax.imshow(small, extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    ax.set_title(title, fontsize=9)
    ax.axis("off")


def _draw_inset(ax: Axes, image: Picture, markers: Sequence[MarkerRecord]) -> None:
    """The first marker enlarged, in the corner that lies opposite to it."""
    known = [marker for marker in markers if marker.new_uv_px is not None]
    if not known:
        return
    crosses = np.array(known[0].new_uv_px)
    centre, half = crosses.mean(axis=0), 0.75 * float(np.ptp(crosses, axis=0).max())
    low = np.maximum(centre - half, 0).astype(int)
    high = np.minimum(centre + half, image.shape[1::-1]).astype(int)
    left, low_down = centre < np.array(image.shape[1::-1]) / 2
    inset = ax.inset_axes((0.63 if left else 0.01, 0.02 if low_down else 0.50, 0.36, 0.48))
    extent = (low[0] - 0.5, high[0] - 0.5, high[1] - 0.5, low[1] - 0.5)
    inset.imshow(image[low[1] : high[1], low[0] : high[0]], extent=extent)
    inset.set(xticks=[], yticks=[], xlim=extent[:2], ylim=extent[2:])
    _draw_offsets(inset, known[:1])


def _draw_offsets(ax: Axes, markers: Sequence[MarkerRecord]) -> None:
    for marker in markers:
        if marker.standard_uv_px is None or marker.new_uv_px is None:
            continue
        before, after = np.array(marker.standard_uv_px), np.array(marker.new_uv_px)
        tips = before + MAGNIFY * (after - before)
        for start, tip in zip(before, tips, strict=True):
            ax.plot(*np.column_stack([start, tip]), color=NEW, linewidth=1.6)
        ax.plot(*before.T, linestyle="", marker="+", color=STANDARD, markersize=9)
        ax.plot(*after.T, linestyle="", marker="o", color=NEW, markersize=6, fillstyle="none")
        left, top = np.vstack([before, after]).min(axis=0)
        ax.annotate(
            marker.id, (left, top), xytext=(-2, 6), textcoords="offset points", fontsize=8,
            fontweight="bold", bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        )  # fmt: skip
