"""The figure of a view plan: what each picture covers of the board, and which part it shows."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.nominal import View
from aoicell.planning.coverage import Scene
from aoicell.planning.table import CoverageTable
from aoicell.report.style import OTHER_METHODS, new_figure
from aoicell.transforms import Array

COLOURS = ("#0072B2", "#D55E00", *OTHER_METHODS[:3])
HIDDEN, MISSED = "#BBBBBB", "#FF0000"


def coverage_figure(
    board: BoardDesign, scene: Scene, views: Sequence[View], table: CoverageTable
) -> Figure:
    """The board from above (mm): targets in the colour of their view, the pictures' outlines.

    Dashed: what of a picture lies within the margin, on the board's plane.
    """
    width, depth = board.size[0] * 1e3, board.size[1] * 1e3
    figure = new_figure(10, 1.2 + 9 * (depth + 60) / (width + 60))
    ax = figure.add_subplot()
    _relief(ax, scene)
    colours = {view.id: COLOURS[k % len(COLOURS)] for k, view in enumerate(views)}
    _targets(ax, scene, table, colours)
    for marker in board.markers:
        plate = marker.plate() * 1e3
        ax.add_patch(Polygon(plate, fill=False, edgecolor="k", linewidth=1))
        x, y = plate.mean(axis=0)
        ax.text(x, y, marker.id, ha="center", va="center", fontsize=9)
    for view in views:
        _outline(ax, scene.camera, view, scene.limits.margin_px, colours[view.id])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, depth / 2]
    ax.add_patch(Polygon(corners, fill=False, edgecolor="k", linewidth=1.5))
    ax.set(aspect="equal", xlabel="x mm", ylabel="y mm")
    ax.autoscale_view()
    _legend(figure, colours, table)
    return figure


def _relief(ax: Axes, scene: Scene) -> None:
    """Heights in shades of grey, for a board that is a mesh or has tall parts."""
    field = scene.field
    rows, columns = field.heights.shape
    x, y = (v * 1e3 for v in field.origin)
    half = field.cell * 1e3 / 2
    right, top = x + (columns - 1) * 2 * half, y + (rows - 1) * 2 * half
    step = max(1, max(rows, columns) // 800)
    ax.imshow(
        field.heights[::step, ::step], origin="lower", cmap="Greys", alpha=0.25,
        extent=(x - half, right + half, y - half, top + half), interpolation="nearest",
    )  # fmt: skip


def _targets(ax: Axes, scene: Scene, table: CoverageTable, colours: Mapping[str, str]) -> None:
    """The places of a target's features, as squares about the points that stand for them."""
    places: dict[str, list[Array]] = {}
    for feature in scene.features:
        places.setdefault(feature.target, []).append(feature.corners[:, :2])
    for row in table.targets:
        if row.target not in places:
            continue
        colour = {"hidden": HIDDEN, "missed": MISSED}.get(row.state, colours.get(row.view, MISSED))
        corners = np.vstack(places[row.target]) * 1e3
        pad = np.maximum(0.4, 1.5 - np.ptp(corners, axis=0) / 2)  # points and chips stay visible
        low, high = corners.min(axis=0) - pad, corners.max(axis=0) + pad
        box = [low, (high[0], low[1]), high, (low[0], high[1])]
        ax.add_collection(
            PolyCollection([box], facecolor=colour, alpha=0.55, edgecolor=colour, linewidth=0.6)
        )


def _outline(ax: Axes, camera: Camera, view: View, margin_px: float, colour: str) -> None:
    for inset, style in ((0.0, "-"), (margin_px, "--")):
        corners = on_plane(camera, view, inset) * 1e3
        ax.add_patch(Polygon(corners, fill=False, edgecolor=colour, linewidth=1.6, linestyle=style))
    ax.plot(view.aim[0] * 1e3, view.aim[1] * 1e3, "+", color=colour, markersize=12)
    ax.annotate(
        view.id, (view.aim[0] * 1e3, view.aim[1] * 1e3), xytext=(5, 5),
        textcoords="offset points", color=colour, fontweight="bold",
    )  # fmt: skip


def on_plane(camera: Camera, view: View, inset_px: float = 0.0) -> Array:
    """Where the picture's corners (4, 2), moved in by `inset_px`, look on the board's plane (m)."""
    low = inset_px
    right, bottom = camera.width - 1 - inset_px, camera.height - 1 - inset_px
    uv = np.array([[low, low], [right, low], [right, bottom], [low, bottom]])
    rays = np.column_stack([camera.unproject(uv), np.ones(4)])
    T = view.T_target_camera
    rays = rays @ T.rotation.T
    reach = -T.translation[2] / rays[:, 2]
    return np.asarray((T.translation + reach[:, None] * rays)[:, :2])


def _legend(figure: Figure, colours: Mapping[str, str], table: CoverageTable) -> None:
    def mark(colour: str, label: str) -> Line2D:
        return Line2D([], [], linestyle="", marker="s", color=colour, alpha=0.7, label=label)

    counts = {view: sum(row.view == view for row in table.targets) for view in colours}
    handles = [mark(c, f"{view}: {counts[view]} targets") for view, c in colours.items()]
    states = [row.state for row in table.targets]
    for state, colour in (("hidden", HIDDEN), ("missed", MISSED)):
        if state in states:
            handles.append(mark(colour, f"{state}: {states.count(state)}"))
    handles.append(Line2D([], [], color="k", linestyle="--", label="picture less its margin"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
