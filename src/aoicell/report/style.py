"""One look for all figures: colours that also the colour-blind tell apart, PNG and SVG."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

# Okabe and Ito's palette
METHOD_COLOURS = {"paper": "#D55E00", "aoicell": "#0072B2"}
STANDARD, NEW, REFERENCE = "#009E73", "#D55E00", "#555555"


def new_figure(width: float, height: float) -> Figure:
    """An empty figure (inches) with a canvas of its own: no global state."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path, vector: bool = True) -> list[Path]:
    """Write the figure as PNG, and as SVG when it is mostly lines."""
    path.parent.mkdir(parents=True, exist_ok=True)
    written = [path.with_suffix(".png")]
    figure.savefig(written[0], dpi=110)
    if vector:
        written.append(path.with_suffix(".svg"))
        figure.savefig(written[1])
    return written
