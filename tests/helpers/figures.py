"""Figures as PNG alone: what is drawn does not depend on the formats, and each takes its time."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

from matplotlib.figure import Figure

from aoicell.report.style import PNG_DPI


def _save(figure: Figure, path: Path, vector: bool = True) -> list[Path]:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path.with_suffix(".png"), dpi=PNG_DPI)
    return [path.with_suffix(".png")]


@contextmanager
def png_alone() -> Iterator[None]:
    """While it lasts, a run's figures and those of its page are no SVG and PDF, too."""
    with patch("aoicell.report.figures.save", _save), patch("aoicell.report.page.save", _save):
        yield
