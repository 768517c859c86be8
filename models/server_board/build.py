"""Builds components.csv from the placement rules and renders server_board.png.

Run from the repository's root: `python models/server_board/build.py` (`--list` skips the picture).
"""

from __future__ import annotations

import csv
import sys
import tomllib
from pathlib import Path

from layout import server_board

from aoicell.board import COLUMNS, load_board

HERE = Path(__file__).parent


def main() -> None:
    """Write the list, check it as every user of the board will, and draw the picture."""
    table = tomllib.loads((HERE / "board.toml").read_text(encoding="utf-8"))
    markers = [(m["x_mm"], m["y_mm"], m["size_mm"]) for m in table["marker"]]
    with (HERE / "components.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for id, kind, *numbers, label, on in server_board(markers):
            writer.writerow([id, kind, *(f"{float(n):g}" for n in numbers), label, on])
    board = load_board(HERE)
    print(f"{len(board.components)} components, {len(board.markers)} markers")
    if "--list" not in sys.argv:
        from preview import render_oblique

        render_oblique(board, HERE / "server_board.png")


if __name__ == "__main__":
    main()
