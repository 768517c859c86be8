"""The look of the page's axes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter


def log_scale(ax: Axes, axis: str) -> None:
    """A logarithmic axis with plain numbers; between them, where there are few decades."""
    least = ax.dataLim.minposx if axis == "x" else ax.dataLim.minposy
    if not np.isfinite(least):
        return  # nothing positive: an exact cell
    scale = ax.set_xscale if axis == "x" else ax.set_yscale
    scale("log")
    chosen = ax.xaxis if axis == "x" else ax.yaxis
    low, high = ax.get_xlim() if axis == "x" else ax.get_ylim()
    few = high / low < 200
    chosen.set_major_locator(LogLocator(10, (1, 2, 5) if few else (1,)))
    chosen.set_major_formatter(
        FuncFormatter(lambda value, _: np.format_float_positional(value, trim="-"))
    )
    chosen.set_minor_formatter(NullFormatter())


def finish(ax: Axes, grid: str = "both") -> None:
    """Quiet axes: two spines, a pale grid behind the data."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color("#999999")
    ax.tick_params(which="both", color="#999999", labelsize=9)
    ax.grid(axis=grid, which="major", color="#dddddd", linewidth=0.6)  # type: ignore[arg-type]
    ax.set_axisbelow(True)


def legend_below(figure: Figure, ax: Axes) -> None:
    """Below the axes, where it hides nothing; marks at full strength."""
    handles, labels = ax.get_legend_handles_labels()
    if not labels:
        return
    columns = len(labels) if len(labels) < 5 else (len(labels) + 1) // 2
    legend = figure.legend(
        handles, labels, loc="outside lower center", ncols=columns, fontsize=9, frameon=False,
        columnspacing=1.4, handlelength=1.6,
    )  # fmt: skip
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):
            handle.set_alpha(1)
            handle.set_rasterized(False)
            if handle.get_marker() not in ("", "None", None):
                handle.set_markersize(5)
