"""One look for all figures: colours that also the colour-blind tell apart; PNG, SVG and PDF."""

from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

# Okabe and Ito's palette
METHOD_COLOURS = {"paper": "#D55E00", "aoicell": "#0072B2"}
STANDARD, NEW, REFERENCE = "#009E73", "#D55E00", "#555555"
OTHER_METHODS = ("#CC79A7", "#009E73", "#E69F00", "#56B4E9")
PNG_DPI = 110
RASTER_DPI = 160  # of clouds of points within vector figures

# The same figure gives the same bytes; in a PDF the text stays text.
REPEATABLE: Any = {"svg.hashsalt": "aoicell", "pdf.fonttype": 42}

# The few pixels of the drawn marks would lose their colours to the photographs'.
_KEPT = np.array(
    [[round(255 * c) for c in to_rgb(name)] for name in (STANDARD, NEW, "k", "w")], np.uint8
)


def colours_of(methods: Iterable[str]) -> dict[str, str]:
    """A colour for each method, also for those that are not the project's own."""
    others = [name for name in methods if name not in METHOD_COLOURS]
    repeated = (OTHER_METHODS[k % len(OTHER_METHODS)] for k in range(len(others)))
    return {**METHOD_COLOURS, **dict(zip(others, repeated, strict=True))}


def new_figure(width: float, height: float) -> Figure:
    """An empty figure (inches) with a canvas of its own: no global state."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path, vector: bool = True) -> list[Path]:
    """Write the figure as PNG, and as SVG and PDF when it is mostly lines.

    Photographs are noisy and compress badly: they get a palette of 256 colours, a third the size.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    png, svg, pdf = (path.with_suffix(suffix) for suffix in (".png", ".svg", ".pdf"))
    if not vector:
        _save_with_palette(figure, png)
        return [png]
    figure.draw_without_rendering()
    figure.set_layout_engine(None)  # the layout is found once, not for each format
    figure.savefig(png, dpi=PNG_DPI)
    with rc_context(REPEATABLE):
        figure.savefig(svg, metadata={"Date": None}, dpi=RASTER_DPI)
        figure.savefig(pdf, metadata={"CreationDate": None}, dpi=RASTER_DPI)
    return [png, svg, pdf]


def _save_with_palette(figure: Figure, path: Path) -> None:
    raw = BytesIO()
    figure.savefig(raw, format="raw", dpi=PNG_DPI)
    width, height = (int(inches * PNG_DPI) for inches in figure.get_size_inches())
    pixels = np.frombuffer(raw.getvalue(), np.uint8).reshape(height, width, 4)[:, :, :3]
    photograph = Image.fromarray(pixels).quantize(256 - len(_KEPT), dither=Image.Dither.NONE)
    colours = np.array(photograph.getpalette(), np.uint8).reshape(-1, 3)[: 256 - len(_KEPT)]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.vstack([colours, _KEPT]).ravel().tolist())
    mapped = Image.fromarray(pixels).quantize(palette=palette, dither=Image.Dither.NONE)
    indices = np.array(mapped)
    for index, colour in enumerate(_KEPT, start=len(colours)):  # the search is approximate
        indices[(pixels == colour).all(axis=2)] = index
    exact = Image.fromarray(indices)
    exact.putpalette(palette.getpalette() or [])
    exact.save(path, dpi=(PNG_DPI, PNG_DPI))
