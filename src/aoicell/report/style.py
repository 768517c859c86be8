"""One look for all figures: colours that also the colour-blind tell apart, PNG and SVG."""

from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

# Okabe and Ito's palette
METHOD_COLOURS = {"paper": "#D55E00", "aoicell": "#0072B2"}
STANDARD, NEW, REFERENCE = "#009E73", "#D55E00", "#555555"
PNG_DPI = 110

# The few pixels of the drawn marks would lose their colours to the photographs'.
_KEPT = np.array(
    [[round(255 * c) for c in to_rgb(name)] for name in (STANDARD, NEW, "k", "w")], np.uint8
)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure (inches) with a canvas of its own: no global state."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path, vector: bool = True) -> list[Path]:
    """Write the figure as PNG, and as SVG when it is mostly lines.

    Photographs are noisy and compress badly: they get a palette of 256 colours, a third the size.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    written = [path.with_suffix(".png")]
    if vector:
        written.append(path.with_suffix(".svg"))
        figure.savefig(written[0], dpi=PNG_DPI)
        figure.savefig(written[1])
    else:
        _save_with_palette(figure, written[0])
    return written


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
