"""Builds components.csv from the placement rules and renders server_board.png.

Run from the repository's root: `python models/server_board/build.py` (`--list` skips the picture).
"""

from __future__ import annotations

import csv
import sys
import tomllib
from pathlib import Path

from layout import server_board

from aoicell.board import COLUMNS, TOLERANCE, load_board

HERE = Path(__file__).parent
TOLERANCES = {  # a class of board.toml by kind
    "capacitor": "power", "inductor": "power", "resistor": "chip", "led": "chip",
    "chip": "leaded", "crystal": "leaded", "socket": "leaded",
    "connector": "through_hole", "dimm_slot": "through_hole", "battery": "through_hole",
    "dimm_module": "plugged", "heatsink": "mounted", "screw": "screw", "label": "label",
}  # fmt: skip
CHIP_PART_MM = 3.0  # the longer side of a ceramic capacitor is below that, of a can above


def tolerance(kind: str, width: float, depth: float) -> str:
    """The class of a part: by its kind, and of a capacitor by its size (mm)."""
    ceramic = kind == "capacitor" and max(width, depth) < CHIP_PART_MM
    return "chip" if ceramic else TOLERANCES[kind]


def main() -> None:
    """Write the list, check it as every user of the board will, and draw the picture."""
    table = tomllib.loads((HERE / "board.toml").read_text(encoding="utf-8"))
    markers = [(m["x_mm"], m["y_mm"], m["size_mm"]) for m in table["marker"]]
    with (HERE / "components.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*COLUMNS, TOLERANCE])
        for id, kind, *numbers, label, on in server_board(markers):
            figures = [f"{float(n):g}" for n in numbers]
            writer.writerow([id, kind, *figures, label, on, tolerance(kind, *numbers[3:5])])
    board = load_board(HERE)
    print(f"{len(board.components)} components, {len(board.markers)} markers")
    if "--list" not in sys.argv:
        from preview import render_oblique

        render_oblique(board, HERE / "server_board.png")


if __name__ == "__main__":
    main()
