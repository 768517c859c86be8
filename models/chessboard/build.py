"""Draw chessboard.png: both prints to scale, with their frames.

python models/chessboard/build.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from aoicell.nominal import load_chessboard
from aoicell.targets.chessboard import Chessboard

HERE = Path(__file__).parent
BOARDS = {"armtarget": "chessboard 1, on the arm", "tabletarget": "chessboard 2, on the table"}
SIZE_IN, DPI = (12.0, 5.4), 100
VIEW_MM = (118.0, 104.0)  # half of what each panel shows


def main() -> None:
    """Write the picture."""
    figure, panels = plt.subplots(1, 2, figsize=SIZE_IN, facecolor="#d9dde2")
    for axes, (name, title) in zip(panels, BOARDS.items(), strict=True):
        draw(axes, load_chessboard(HERE / f"{name}.toml"), f"{name}: {title}")
    figure.subplots_adjust(0.01, 0.02, 0.99, 0.92, wspace=0.02)
    figure.savefig(HERE / "chessboard.png", dpi=DPI)


def draw(axes: Axes, board: Chessboard, title: str) -> None:
    """Draw one print as seen from the front, with its frame, its size and its square."""
    half_x, half_y = board.size[0] * 500, board.size[1] * 500
    extent = (-half_x, half_x, -half_y, half_y)
    axes.imshow(board.print_image(), cmap="gray", vmin=0, vmax=265, extent=extent)
    for dx, dy, letter, colour in ((1, 0, "x", "#d62728"), (0, 1, "y", "#2ca02c")):
        tip = (34 * dx, 34 * dy)
        arrow = {"arrowstyle": "-|>", "color": colour, "lw": 3, "mutation_scale": 18}
        axes.annotate("", tip, (0, 0), arrowprops=arrow)
        axes.text(
            1.18 * tip[0], 1.18 * tip[1], letter, color=colour, fontsize=17, fontweight="bold",
            ha="center", va="center", bbox={"fc": "white", "ec": "none", "pad": 1.5},
        )  # fmt: skip
    axes.plot(0, 0, "o", color="#1f77b4", ms=9)
    label = (
        f"{2 * half_x:g} x {2 * half_y:g} mm, squares of {board.square * 1e3:g} mm, "
        f"{board.columns} x {board.rows} inner corners"
    )
    axes.text(0, -half_y - 4, label, ha="center", va="top", fontsize=12)
    axes.set(xlim=(-VIEW_MM[0], VIEW_MM[0]), ylim=(-VIEW_MM[1], VIEW_MM[1]))
    axes.set_title(title, fontsize=14)
    axes.set_axis_off()


if __name__ == "__main__":
    main()
