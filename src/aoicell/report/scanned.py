"""The figure of a scanned board: its relief, and what was taken for a target."""

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from numpy.typing import NDArray

from aoicell.board.design import rectangle
from aoicell.observation import Image
from aoicell.planning.bumps import Bump
from aoicell.planning.heights import HeightField
from aoicell.planning.scan_comparison import Comparison
from aoicell.planning.scanned_model import ScannedModel
from aoicell.report.style import NEW, STANDARD, new_figure
from aoicell.transforms import apply

MISSED, PIECE = "#E69F00", "#56B4E9"
UNSEEN = "#5b3a5b"


def scanned_figure(model: ScannedModel, comparison: Comparison) -> Figure:
    """The board from above (mm, the scan's frame): found targets, extra ones, missed ones."""
    width, depth = model.board.size[0] * 1e3, model.board.size[1] * 1e3
    figure = new_figure(11, 1.0 + 10 * depth / width)
    ax = figure.add_subplot()
    ax.set_facecolor(UNSEEN)
    picture = ax.imshow(
        model.heights.heights * 1e3,
        cmap="gray",
        vmin=0,
        origin="lower",
        extent=_extent(model.heights),
    )
    figure.colorbar(picture, ax=ax, shrink=0.7, label="height mm (purple: not seen)")
    matched = {id(match.bump) for match in comparison.matches}
    pieces = {id(bump) for bump in comparison.pieces}
    for bump in model.bumps:
        other = PIECE if id(bump) in pieces else NEW
        ax.add_patch(_box(bump, STANDARD if id(bump) in matched else other))
    for target in comparison.missed:
        x, y, _ = apply(comparison.T_scan_board, np.array([target.x, target.y, 0.0])) * 1e3
        size = max(target.width, target.depth) * 1e3
        corner = (x - size / 2, y - size / 2)
        ax.add_patch(Rectangle(corner, size, size, fill=False, edgecolor=MISSED, linestyle=":"))
    marks = [
        Rectangle((0, 0), 1, 1, fill=False, edgecolor=colour, label=label)
        for colour, label in (
            (STANDARD, f"of the design ({len(comparison.matches)})"),
            (PIECE, f"piece of a designed part ({len(pieces)})"),
            (NEW, f"not of the design ({len(comparison.extra)})"),
            (MISSED, f"missed ({len(comparison.missed)})"),
        )
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=4)
    ax.set(aspect="equal", xlabel="x mm", ylabel="y mm")
    return figure


def coloured_depth(depth: NDArray[np.float32]) -> Image:
    """A depth image (H, W; m) as RGB, what is near bright; red where nothing was measured."""
    near, far = np.nanpercentile(depth, [1, 99])
    closeness = np.clip((far - np.nan_to_num(depth, nan=far)) / max(far - near, 1e-9), 0, 1)
    rgb: Image = np.rint(colormaps["viridis"](closeness)[..., :3] * 255).astype(np.uint8)
    rgb[np.isnan(depth)] = (255, 0, 0)
    return rgb


def _box(bump: Bump, colour: str) -> Polygon:
    corners = rectangle(bump.x, bump.y, bump.rotation, bump.width, bump.depth) * 1e3
    return Polygon(corners, fill=False, edgecolor=colour, linewidth=1)


def _extent(heights: HeightField) -> tuple[float, float, float, float]:
    rows, columns = heights.heights.shape
    (x, y), half = heights.origin, heights.cell / 2
    right, top = x + (columns - 1) * heights.cell, y + (rows - 1) * heights.cell
    return ((x - half) * 1e3, (right + half) * 1e3, (y - half) * 1e3, (top + half) * 1e3)
