"""The board's file: what the shipped one promises, and what a bad one is told."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.board import BoardDesign, load_board, rectangles_overlap
from aoicell.errors import InputError

FOLDER = Path(__file__).parents[1] / "models" / "server_board"

HEADER = "id,kind,x_mm,y_mm,rotation_deg,width_mm,depth_mm,height_mm,label,on"
TOML = """
name = "small"
size_mm = [100.0, 80.0, 2.0]
colour = [0.0, 0.2, 0.1]
components = "components.csv"
[[marker]]
id = "M1"
kind = "cross"
role = "positioning"
x_mm = -30.0
y_mm = 20.0
z_mm = 0.5
rotation_deg = 90.0
size_mm = 30.0
pitch_mm = 18.0
"""


@pytest.fixture(scope="module")
def board() -> BoardDesign:
    return load_board(FOLDER)


def write(folder: Path, *rows: str, toml: str = TOML, header: str = HEADER) -> Path:
    (folder / "board.toml").write_text(toml)
    (folder / "components.csv").write_text("\n".join([header, *rows]) + "\n")
    return folder


def refusal(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        load_board(folder)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_the_shipped_board(board: BoardDesign) -> None:
    assert board.size == pytest.approx((0.42, 0.33, 0.002))
    assert [m.id for m in board.markers if m.role == "positioning"] == ["M1"]
    assert [m.id for m in board.markers if m.role == "measuring"] == ["M2", "M3", "M4"]
    assert all((m.size, m.pitch, m.z) == (0.06, 0.036, 0.0005) for m in board.markers)
    assert 150 <= len(board.components) <= 260
    assert max(c.top for c in board.components) <= 0.032


def test_the_marker_layout_tells_the_orientation(board: BoardDesign) -> None:
    points = np.array([[m.x, m.y] for m in board.markers])
    for symmetry in ([-1, -1], [-1, 1], [1, -1]):
        distances = np.linalg.norm(points[:, None] - (points * symmetry)[None], axis=2)
        assert distances.min(axis=1).max() > 0.02


def test_nothing_hides_a_marker_at_25_degrees(board: BoardDesign) -> None:
    for marker in board.markers:
        for c in board.components:
            centre = np.array([marker.x, marker.y])
            gap = np.abs(_sampled_outline(c.footprint) - centre) - marker.size / 2
            distance = np.linalg.norm(np.maximum(gap, 0), axis=1).min()
            assert distance >= math.tan(math.radians(25)) * (c.top - marker.z), (c.id, marker.id)


def _sampled_outline(corners: np.ndarray) -> np.ndarray:
    t = np.linspace(0, 1, 40)[:, None]
    edges = np.roll(corners, -1, axis=0) - corners
    return np.concatenate([a + t * edge for a, edge in zip(corners, edges, strict=True)])


def test_a_stacked_component_starts_on_its_parent(board: BoardDesign) -> None:
    slot, module = board.component("SLOT_A1"), board.component("DIMM_A1")
    assert module.on == slot.id
    assert module.z == pytest.approx(slot.top)
    assert module.rotation == pytest.approx(math.pi / 2)


def test_a_parent_may_come_later_and_stand_on_another(tmp_path: Path) -> None:
    board = load_board(
        write(
            tmp_path,
            "LBL1,label,10,0,0,5,5,0.2,text,HS1",
            "HS1,heatsink,10,0,0,20,20,12,,U1",
            "U1,chip,10,0,45,10,10,2,,",
        )
    )
    assert board.component("LBL1").z == pytest.approx(0.014)
    assert board.component("U1").z == 0
    assert board.markers[0].rotation == pytest.approx(math.pi / 2)


def test_an_unknown_id_gets_the_nearest(board: BoardDesign) -> None:
    with pytest.raises(InputError, match=r"'DIMM_A11'.*did you mean 'DIMM_A1'"):
        board.component("DIMM_A11")


GOOD = "U1,chip,10,0,0,10,10,2,,"


@pytest.mark.parametrize(
    ("row", "parts"),
    [
        ("U2,chipp,30,0,0,5,5,1,,", ["line 3", "kind", "'chipp'", "did you mean 'chip'"]),
        ("U2,chip,far,0,0,5,5,1,,", ["line 3", "x_mm", "'far' is not a number"]),
        ("U2,chip,nan,0,0,5,5,1,,", ["line 3", "x_mm", "'nan'"]),
        ("U2,chip,30,0,0,-5,5,1,,", ["line 3", "width_mm", "'-5'", "give 0.1 to"]),
        ("U2,chip,30,0,0,5,5,900,,", ["line 3", "height_mm", "'900'"]),
        ("U1,chip,30,0,0,5,5,1,,", ["line 3", "column id", "'U1' is there already"]),
        (" ,chip,30,0,0,5,5,1,,", ["line 3", "column id", "' '"]),
        ("M1,chip,30,0,0,5,5,1,,", ["marker[0]", "'M1', which is taken"]),
        ("U2,chip,49,0,0,5,5,1,,", ["line 3", "U2", "leaves the outline of 100 x 80 mm"]),
        ("J1,connector,30,39,0,5,14,1,,", ["line 3", "J1", "leaves the outline"]),
        ("U2,chip,17,0,45,8,8,1,,", ["line 3", "U2 overlaps U1 (line 2)"]),
        ("C1,capacitor,-13.5,20,0,2,2,1,,", ["line 3", "C1", "2 mm to marker M1"]),
        ("HS1,heatsink,10,0,0,9,9,5,,U11", ["line 3", "column on", "did you mean 'U1'"]),
        ("HS1,heatsink,10,0,0,9,9,5,,HS1", ["line 3", "column on", "stand on itself"]),
        ("U2,chip,30,0,0,5,5", ["line 3", "exactly 10 values"]),
    ],
)
def test_a_bad_row_is_named(tmp_path: Path, row: str, parts: list[str]) -> None:
    message = refusal(write(tmp_path, GOOD, row))
    assert all(part in message for part in parts), message


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("size_mm = [100.0, 80.0, 2.0]", "size_mm = [100.0, 80.0]", ["size_mm", "3 numbers"]),
        ("[0.0, 0.2, 0.1]", "[0, 44, 20]", ["'colour' is [0, 44, 20]", "3 numbers from 0 to 1"]),
        ('kind = "cross"', 'kind = "cros"', ["marker[0].kind", "is 'cros'", "must be 'cross'"]),
        ('role = "positioning"', "", ["marker[0].role' is missing"]),
        ('role = "positioning"', "role = 3", ["marker[0].role' is 3", "must be a text"]),
        ("pitch_mm = 18.0", "pitch_mm = 38.0", ["marker[0].pitch_mm' is 38.0", "from 0.1 to 30"]),
        ("x_mm = -30.0", "x_mm = -36.0", ["marker[0]", "M1 at x_mm = -36", "leaves the outline"]),
        ('"components.csv"', '"parts.csv"', ["parts.csv: no such file"]),
        ('name = "small"', "name = ", ["board.toml: not valid TOML"]),
    ],
)
def test_a_bad_table_is_named(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    assert TOML.count(old) == 1
    message = refusal(write(tmp_path, GOOD, toml=TOML.replace(old, new)))
    assert all(part in message for part in parts), message


def test_a_missing_file_or_column_is_named(tmp_path: Path) -> None:
    assert "board.toml: no such file" in refusal(tmp_path)
    message = refusal(write(tmp_path, GOOD, header=HEADER.replace("depth_mm", "dept")))
    assert "line 1" in message
    assert "'depth_mm' is missing" in message


def test_a_connector_may_stand_out_over_the_rear_edge_only(tmp_path: Path) -> None:
    load_board(write(tmp_path, "J1,connector,30,38,0,10,14,5,,"))
    assert "leaves the outline" in refusal(write(tmp_path, "J1,connector,30,-38,0,10,14,5,,"))
    assert "leaves the outline" in refusal(write(tmp_path, "U1,chip,30,38,0,10,14,5,,"))


def test_a_copy_elsewhere_reads_the_same(board: BoardDesign, tmp_path: Path) -> None:
    for name in ("board.toml", "components.csv"):
        shutil.copy(FOLDER / name, tmp_path)
    assert load_board(tmp_path) == board


ANGLES = st.floats(-math.pi, math.pi)
SIDES = st.floats(1e-3, 0.05)


@given(ANGLES, ANGLES, SIDES, SIDES, st.floats(-0.06, 0.06), st.floats(-0.06, 0.06))
def test_overlap_is_mutual_and_sees_a_centre_inside(
    turn_a: float, turn_b: float, width: float, depth: float, x: float, y: float
) -> None:
    a, b = _box(0, 0, turn_a, width, depth), _box(x, y, turn_b, 0.02, 0.01)
    assert rectangles_overlap(a, b) == rectangles_overlap(b, a)
    local = np.array([[math.cos(turn_a), math.sin(turn_a)], [-math.sin(turn_a), math.cos(turn_a)]])
    inside = np.abs(local @ [x, y]) < np.array([width, depth]) / 2
    assert not inside.all() or rectangles_overlap(a, b)
    far = math.hypot(x, y) > (math.hypot(width, depth) + math.hypot(0.02, 0.01)) / 2
    assert not far or not rectangles_overlap(a, b)


def _box(x: float, y: float, turn: float, width: float, depth: float) -> np.ndarray:
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, depth / 2]
    c, s = math.cos(turn), math.sin(turn)
    corners: np.ndarray = half @ np.array([[c, s], [-s, c]]) + [x, y]
    return corners
