"""The paper's Figure 8: board, marker, and where the camera goes, before and after."""

from collections.abc import Iterable

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from aoicell.benchmark.records import TrialRecord
from aoicell.nominal import Nominal
from aoicell.report.style import NEW, STANDARD, new_figure
from aoicell.transforms import SE3, Array, apply, from_matrix


def schematic(trials: Iterable[TrialRecord], nominal: Nominal) -> Figure:
    """One 3D panel a test: the board and the views as taught, and after the correction."""
    shown = list(trials)
    figure = new_figure(6.2 * len(shown), 6.4)
    for index, trial in enumerate(shown, start=1):
        ax = figure.add_subplot(1, len(shown), index, projection="3d")
        _draw_trial(ax, trial, nominal)
    handles = [
        Line2D([], [], color=colour, label=label)
        for colour, label in (
            (STANDARD, "board and views as taught"),
            (NEW, "moved, and corrected"),
            ("#0072B2", "positioning marker"),
            ("red", "camera's x"),
            ("green", "camera's y"),
        )
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False)
    return figure


def _draw_trial(ax: Axes3D, trial: TrialRecord, nominal: Nominal) -> None:
    taught, now = from_matrix(trial.T_base_board_taught), from_matrix(trial.T_base_board_now)
    for T_base_board, colour in ((taught, STANDARD), (now, NEW)):
        _draw_board(ax, T_base_board, nominal, colour)
    for view in trial.views:
        for matrix, board, colour in (
            (view.T_base_camera_taught, taught, STANDARD),
            (view.T_base_camera_new, now, NEW),
        ):
            _draw_view(ax, from_matrix(matrix), board, nominal, colour)
        label = np.array(view.T_base_camera_taught)[:3, 3] * 1e3
        ax.text(label[0], label[1], label[2] + 25, view.id, fontsize=9)
    ax.set_title(
        f"test {trial.trial + 1} ({trial.method}): moved {trial.displacement_mm:.1f} mm, "
        f"turned {trial.turn_deg:.1f} deg",
        fontsize=10,
    )
    ax.set_xlabel("x mm")
    ax.set_ylabel("y mm")
    ax.set_zlabel("z mm")
    ax.set_aspect("equal")
    ax.view_init(elev=28, azim=-60)
    ax.tick_params(labelsize=7)


def _draw_board(ax: Axes3D, T_base_board: SE3, nominal: Nominal, colour: str) -> None:
    width, height, _ = nominal.board.size
    outline = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [
        width / 2,
        height / 2,
        0,
    ]
    _outline(ax, apply(T_base_board, outline), colour, 1.6)
    marker = apply(T_base_board * nominal.T_board_positioning, nominal.marker.outline)
    ax.add_collection3d(Poly3DCollection([marker * 1e3], facecolor="#0072B2", alpha=0.7))


def _draw_view(
    ax: Axes3D, T_base_camera: SE3, T_base_board: SE3, nominal: Nominal, colour: str
) -> None:
    """The camera's axes, and the rectangle that it photographs on the board's plane."""
    camera = nominal.cameras["hand"]
    corners_px = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [camera.width - 1, camera.height - 1]
    rays = np.column_stack([camera.unproject(corners_px), np.ones(4)]) @ T_base_camera.rotation.T
    normal, centre = T_base_board.rotation[:, 2], T_base_camera.translation
    reach = (T_base_board.translation - centre) @ normal / (rays @ normal)
    footprint = centre + rays * reach[:, None]
    _outline(ax, footprint, colour, 0.9)
    sides = np.stack([np.repeat(centre[None], 4, axis=0), footprint], axis=1) * 1e3
    ax.add_collection3d(Line3DCollection(sides, colors=colour, linewidths=0.3, alpha=0.6))
    for axis, rgb in ((0, "red"), (1, "green")):
        tip = centre + 0.05 * T_base_camera.rotation[:, axis]
        ax.plot(*(np.column_stack([centre, tip]) * 1e3), color=rgb, linewidth=1.4)


def _outline(ax: Axes3D, points: Array, colour: str, width: float) -> None:
    closed = np.vstack([points, points[:1]]) * 1e3
    ax.plot(*closed.T, color=colour, linewidth=width)
