"""The placement rules of the server board: which part stands where, in millimetres and degrees.

Dual socket: two processors side by side, four memory slots on either side of each, their
regulators above and below, the expansion slots and the I/O connectors at the rear (+y) edge, the
power and drive connectors at the front.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

import numpy as np

from aoicell.board import rectangles_overlap

CPU_X, CPU_Y = 84.0, -8.0
Row = tuple[str, str, float, float, float, float, float, float, str, str]

PREFIX = {
    "socket": "CPU", "heatsink": "HS", "chip": "U", "connector": "J", "capacitor": "C",
    "resistor": "R", "inductor": "L", "screw": "H", "label": "LBL", "crystal": "Y",
    "battery": "BT", "led": "D",
}  # fmt: skip


@dataclass
class Layout:
    """Rows of components.csv as they are placed; ids count up by kind."""

    keep_out: list[tuple[float, float, float]]  # markers: x, y, side
    rows: list[Row] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    rects: list[np.ndarray] = field(default_factory=list)

    def add(
        self, kind: str, x: float, y: float, size: tuple[float, float, float],
        label: str = "", rotation: float = 0.0, on: str = "", id: str = "",
    ) -> str:  # fmt: skip
        """Place one part, size = (width, depth, height); returns its id."""
        if not id:
            self.counts[kind] = self.counts.get(kind, 0) + 1
            id = f"{PREFIX[kind]}{self.counts[kind]}"
        x, y = round(x, 3), round(y, 3)
        self.rows.append((id, kind, x, y, rotation, *size, label, on))
        self.rects.append(rectangle(x, y, size[0], size[1], rotation))
        return id

    def id_of(self, label: str) -> str:
        """The id of the first part with that label."""
        return next(row[0] for row in self.rows if row[8] == label)

    def is_free(self, x: float, y: float, width: float, depth: float, rotation: float) -> bool:
        """Whether a part with a margin of 0.6 mm fits there."""
        rect = rectangle(x, y, width + 1.2, depth + 1.2, rotation)
        plates = [rectangle(mx, my, side + 6, side + 6, 0) for mx, my, side in self.keep_out]
        inside = bool(np.all(np.abs(rect) < [207, 162]))
        return inside and not any(rectangles_overlap(rect, r) for r in self.rects + plates)


def rectangle(x: float, y: float, width: float, depth: float, rotation: float) -> np.ndarray:
    """Corners (4, 2) of a turned rectangle, in metres, as the overlap test wants them."""
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, depth / 2]
    c, s = math.cos(math.radians(rotation)), math.sin(math.radians(rotation))
    return (half @ np.array([[c, s], [-s, c]]) + [x, y]) / 1e3


def server_board(markers: list[tuple[float, float, float]]) -> list[Row]:
    """All rows of the component list."""
    layout = Layout(markers)
    for number, x in ((1, -CPU_X), (2, CPU_X)):
        processor(layout, number, x)
    memory(layout)
    for x in (-CPU_X, CPU_X):
        regulators(layout, x)
    rear_edge(layout)
    expansion_slots(layout)
    logic(layout)
    front_edge(layout)
    sides(layout)
    mounting_holes(layout)
    labels(layout)
    passives(layout)
    return layout.rows


def processor(layout: Layout, number: int, x: float) -> None:
    """A narrow-ILM socket and its 1U heat sink."""
    socket = layout.add("socket", x, CPU_Y, (56, 94, 5), f"LGA3647 CPU{number}")
    layout.add("heatsink", x, CPU_Y, (78, 108, 25.5), "1U", on=socket)


def memory(layout: Layout) -> None:
    """Sixteen slots in four banks; every module is in its slot."""
    for bank, (cpu_x, side) in zip(
        "ABCD", ((-CPU_X, -1), (-CPU_X, 1), (CPU_X, -1), (CPU_X, 1)), strict=True
    ):
        for k in range(4):
            x = cpu_x + side * (45.3 + 9.4 * k)
            slot = layout.add(
                "dimm_slot", x, CPU_Y, (141, 6.6, 7), f"{bank}{k + 1}", 90, id=f"SLOT_{bank}{k + 1}"
            )
            layout.add(
                "dimm_module", x, CPU_Y, (133.35, 4, 23.5), "32GB RDIMM", 90,
                on=slot, id=f"DIMM_{bank}{k + 1}",
            )  # fmt: skip


def regulators(layout: Layout, x: float) -> None:
    """Six phases above the heat sink, the memory's supply below it."""
    for k in range(6):
        dx = -31.5 + 12.6 * k
        layout.add("inductor", x + dx, 51, (7.4, 7, 5), "R15")
        layout.add("chip", x + dx, 59.2, (5, 6, 1), "NCP302")
        layout.add("capacitor", x + dx, 67.2, (8, 8, 11.5), "820 6.3")
    for k in range(3):
        layout.add("capacitor", x - 25 + 25 * k, -66.4, (6.3, 6.3, 7.7), "470 16", 180)
    for dx in (-24, 24):
        layout.add("inductor", x + dx, -76.5, (10, 10, 5.5), "R33")
        layout.add("chip", x + dx * 0.6, -76.5, (5, 6, 1), "NCP302", 90)
    layout.add("chip", x, -76.5, (7, 7, 1), "XDPE12", 45)


def rear_edge(layout: Layout) -> None:
    """I/O stacks; their faces stand 4 mm out over the edge."""
    edge = 169.0
    for x, (width, depth, height), label in (
        (-117, (31, 17, 12.5), "VGA"),
        (-89, (16.5, 22, 26), "RJ45 USB MGMT"),
        (-62, (33, 21.5, 13.5), "RJ45 x2"),
        (-35.5, (14, 17.8, 15.6), "USB x2"),
        (-17, (17, 21.5, 13.5), "RJ45"),
    ):
        layout.add("connector", x, edge - depth / 2, (width, depth, height), label)
    for k, colour in enumerate(("green", "amber", "blue")):
        layout.add("led", -44.0, 150.5 + 4.2 * k, (1.6, 0.8, 0.7), colour)


def expansion_slots(layout: Layout) -> None:
    """Six slots at 20.32 mm; the short ones end at the same line as the long ones."""
    for k, lanes in enumerate((16, 8, 16, 8, 16, 8)):
        length = 89.0 if lanes == 16 else 56.0
        y = 162.0 - length / 2
        x = 14.5 + 20.32 * k
        layout.add("connector", x, y, (length, 7.5, 11.2), f"PCIE x{lanes}", 90)
        if lanes == 8:
            layout.add("capacitor", x, 99, (2.0, 1.25, 1.2), "10u", 90)
            layout.add("chip", x, 89, (6, 5, 1), "PI3EQX", 90)


def logic(layout: Layout) -> None:
    """Chip set, management controller, network and firmware between I/O and processor 1."""
    pch = layout.add("chip", -56, 99, (34, 28, 3), "C621 PCH")
    layout.add("heatsink", -56, 99, (45, 45, 14), "PCH", on=pch)
    layout.add("chip", -106, 124, (21, 21, 1.8), "AST2500 BMC")
    layout.add("chip", -85.5, 126, (8, 13, 1.2), "DDR4 4Gb")
    layout.add("chip", -111, 104, (10.3, 7.5, 2.4), "MX25L BMC FW")
    layout.add("chip", -95, 87, (14, 14, 1.6), "NCT6776")
    layout.add("chip", -62, 134, (17, 17, 1.6), "X550 LAN")
    layout.add("chip", -30, 139, (8, 8, 1), "I210")
    layout.add("chip", -20, 112, (8, 5.3, 1.8), "W25Q BIOS")
    layout.add("chip", -20, 122, (8, 5.3, 1.8), "W25Q BIOS2")
    layout.add("battery", -16, 90, (22, 21, 5.5), "CR2032")
    layout.add("connector", -123, 84, (22, 9, 4.2), "M.2")
    layout.add("crystal", -86, 108, (11, 4.7, 3.6), "25.000", 90)
    layout.add("crystal", -47, 133, (5, 3.2, 1), "25.000")
    layout.add("crystal", -30, 126.5, (5, 3.2, 1), "32.768", 90)
    layout.add("connector", -8, 130, (15.2, 5.1, 8.5), "HDR TPM", 90)


def front_edge(layout: Layout) -> None:
    """Power, drives and fans; the storage controller with its heat sink."""
    layout.add("connector", -80, -158, (51.6, 9.6, 13), "ATX 24")
    layout.add("connector", -38, -158, (21.6, 9.6, 13), "EPS 8")
    layout.add("connector", -13, -158, (21.6, 9.6, 13), "EPS 8")
    for k in range(6):
        x, y = 27 + 22 * (k % 3), (-159, -149)[k // 3]
        layout.add("connector", x, y, (16.5, 6.6, 8.6), f"SATA {k}")
    for y in (-152, -128):
        layout.add("connector", 118, y, (22, 18, 11), "SAS HD")
    sas = layout.add("chip", 66, -119, (29, 29, 3), "SAS3008")
    layout.add("heatsink", 66, -119, (38, 38, 12), "SAS", on=sas)
    for k in range(5):
        layout.add("capacitor", -101 + 13 * k, -144, (10, 10, 16), "1000 16")
    for k in range(3):
        layout.add("inductor", -100 + 17 * k, -128, (13, 13, 7), "1R0")
        layout.add("chip", -100 + 17 * k, -115, (6.5, 9, 2.3), "IRF DPAK", 180)
    layout.add("connector", -28, -143, (26, 5.1, 8.5), "HDR F_PANEL")
    layout.add("connector", 0, -143, (20, 6.5, 8.5), "HDR USB3")
    layout.add("chip", -34, -122, (14, 14, 1.4), "CPLD LCMXO2")
    layout.add("chip", -8, -120, (9, 9, 1), "9ZXL CLK")
    layout.add("chip", 18, -130, (10.3, 7.5, 2.4), "SAS FLASH")
    layout.add("crystal", -8, -131, (5, 3.2, 1), "14.318")
    layout.add("crystal", 31, -131, (11, 4.7, 3.6), "75.000")
    for x in (-96, -62, -10, 24, 100):
        layout.add("connector", x, -95, (10.2, 5.8, 8.5), "FAN 4P")
    for k in range(4):
        layout.add("led", -37 + 4 * k, -103, (2, 1.25, 0.8), ("green", "green", "amber", "red")[k])


def sides(layout: Layout) -> None:
    """The strips outside the memory banks."""
    for x in (-201, 201):
        layout.add("connector", x, 52, (10.2, 5.8, 8.5), "FAN 4P", 90)
    layout.add("connector", -200, 24, (21.6, 9.6, 13), "EPS 8", 90)
    layout.add("connector", 199, -20, (24, 12, 8), "SLIM SAS", 90)
    layout.add("connector", 199, 20, (24, 12, 8), "SLIM SAS", 90)
    layout.add("chip", -182, -36, (12, 12, 1.4), "PEX8 SW", 90)
    layout.add("chip", -181, 60, (9, 9, 1), "ADM1278")
    layout.add("chip", 180, 56, (16, 16, 1.6), "PS5 RETIMER")
    layout.add("chip", 179, -62, (8, 5.3, 1.8), "24C512", 90)
    layout.add("connector", -196, -118, (15.2, 5.1, 8.5), "HDR JTAG", 90)
    layout.add("chip", -190, -70, (8, 5.3, 1.8), "24C64 VPD")
    layout.add("chip", 198, -76, (9, 9, 1), "MP2953", 90)
    layout.add("inductor", -181, 82, (11, 11, 6), "R47")
    layout.add("inductor", 150, 82, (11, 11, 6), "R47")
    for k in range(3):
        layout.add("capacitor", -196 + 0.0, 68 + 9 * k, (6.3, 6.3, 7.7), "220 25")
        layout.add("capacitor", 165 + 9 * k, 82, (6.3, 6.3, 7.7), "220 25")
    layout.add("chip", 134, 82, (6, 5, 1), "TPS546")


def mounting_holes(layout: Layout) -> None:
    """M3 pan heads; the corners, the middles of the edges and the centre."""
    for x, y in (
        (-205, 160), (205, 160), (-205, -160), (205, -160), (-204, -4), (204, -40), (0, CPU_Y),
        (1.5, 158), (12, -160), (-110, -160), (-1.5, 74), (10, -110),
    ):  # fmt: skip
        layout.add("screw", x, y, (7, 7, 2.2), "M3")


def labels(layout: Layout) -> None:
    """Paper labels on the bare board, one on the firmware chip and one on a cage."""
    layout.add("label", -182, 4, (50, 14, 0.2), "S/N AC2106-004071", 90)
    layout.add("label", 181, 0, (44, 14, 0.2), "MAC 02:1D:4C:07:10:A4", 90)
    layout.add("label", -62, -104, (40, 10, 0.2), "SERVER BOARD R1.02")
    layout.add("label", 129, 71, (16, 7, 0.2), "PASS QC3")
    layout.add("label", -111, 104, (7, 5, 0.2), "BMC 1.9", on=layout.id_of("MX25L BMC FW"))
    layout.add("label", 118, -152, (16, 9, 0.2), "HBA 0-3", on=layout.id_of("SAS HD"))


def passives(layout: Layout) -> None:
    """Ceramic capacitors around the bigger chips, then resistors and capacitors in the gaps."""
    draw = random.Random(4071)
    for row in [r for r in layout.rows if r[1] == "chip" and r[5] >= 9]:
        _, _, x, y, rotation, width, depth, *_ = row
        if rotation == 90:
            width, depth = depth, width
        _try(layout, "capacitor", x + width / 2 + 2.4, y + draw.uniform(-2, 2), 90)
        _try(layout, "resistor", x + draw.uniform(-3, 3), y - depth / 2 - 2.4, 0)
    for k in range(4):
        _try(layout, "resistor" if k % 2 else "capacitor", 0, -67 + 34 * k, 0)
    placed = 0
    while placed < 9:  # rows of three, as a bus termination has them
        x, y = draw.uniform(-200, 200), draw.uniform(-150, 150)
        kind, rotation = draw.choice(("resistor", "resistor", "capacitor")), draw.choice((0, 90))
        step = 2.6
        offsets = [(0, step * j) if rotation == 0 else (step * j, 0) for j in range(3)]
        if all(layout.is_free(x + dx, y + dy, 2.2, 2.2, 0) for dx, dy in offsets):
            for dx, dy in offsets:
                _try(layout, kind, x + dx, y + dy, rotation)
            placed += 3


def _try(layout: Layout, kind: str, x: float, y: float, rotation: float) -> None:
    size, label = ((2.0, 1.25, 1.2), "10u") if kind == "capacitor" else ((1.6, 0.8, 0.5), "103")
    x, y = round(x * 2) / 2, round(y * 2) / 2  # on the designer's grid
    if layout.is_free(x, y, size[0], size[1], rotation):
        layout.add(kind, x, y, size, label, rotation)
