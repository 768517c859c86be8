"""Small boards made by hand."""

import math
from pathlib import Path

from aoicell.board import BoardDesign, Component

HEADER = "id,kind,x_mm,y_mm,rotation_deg,width_mm,depth_mm,height_mm,label,on"
TOML = """
name = "small"
size_mm = [100.0, 80.0, 2.0]
colour = [0.0, 0.2, 0.1]
components = "components.csv"
"""
ROWS = (
    "U1,chip,-20,10,0,12,12,2,MCU,",
    "HS1,heatsink,-20,10,0,16,16,8,fin,U1",
    "R1,resistor,20,10,90,1.6,0.8,0.5,103,",
    "C1,capacitor,0,-20,0,6.3,6.3,7.7,470,",
)


def component(
    id: str, kind: str, x_mm: float, y_mm: float, size_mm: tuple[float, float, float],
    rotation_deg: float = 0.0, z_mm: float = 0.0, on: str = "",
) -> Component:  # fmt: skip
    width, depth, height = (side / 1e3 for side in size_mm)
    return Component(
        id, kind, x_mm / 1e3, y_mm / 1e3, z_mm / 1e3, math.radians(rotation_deg),
        width, depth, height, "", on,
    )  # fmt: skip


def board(*components: Component, size_mm: tuple[float, float] = (100, 80)) -> BoardDesign:
    size = (size_mm[0] / 1e3, size_mm[1] / 1e3, 0.002)
    return BoardDesign("small", size, (0.0, 0.2, 0.1), components, ())


def write_board(folder: Path, *rows: str, toml: str = TOML) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "board.toml").write_text(toml)
    (folder / "components.csv").write_text("\n".join([HEADER, *(rows or ROWS)]) + "\n")
    return folder
