"""Lists of placements: units, sizes, and all that is wrong with every line."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.errors import InputError
from aoicell.planning.heights import heights_of
from aoicell.planning.pick_and_place import (
    EIA_MM,
    POINT,
    package_size,
    placement_features,
    read_placements,
)

HEADER = "designator,x_mm,y_mm,rotation_deg,side,package"


def listed(folder: Path, *rows: str, header: str = HEADER) -> Path:
    path = folder / "list.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def refusal(path: Path, unit: str | None = None) -> str:
    with pytest.raises(InputError) as caught:
        read_placements(path, unit)
    return str(caught.value)


def test_a_line_in_si(tmp_path: Path) -> None:
    (placed,) = read_placements(listed(tmp_path, "R1,20,-10,90,top,R_0603_1608Metric"))
    assert (placed.x, placed.y, placed.rotation) == pytest.approx((0.020, -0.010, math.pi / 2))
    assert placed.size == pytest.approx((0.0016, 0.0008))
    assert placed.line == 2


@pytest.mark.parametrize(
    ("header", "unit", "row"),
    [
        ("Ref,Val,Package,PosX,PosY,Rot,Side", "mm", "R1,10k,0603,20,-10,90,top"),
        ("Designator,Center-X(mm),Center-Y(mm),Rotation,Layer", None, "R1,20,-10,90,TopLayer"),
        ("designator,x_in,y_in,rotation_deg", None, "R1,0.7874015748,-0.3937007874,90"),
        ("designator,x,y,rotation", "mil", "R1,787.4015748,-393.7007874,90"),
    ],
)
def test_headers_of_other_tools(tmp_path: Path, header: str, unit: str | None, row: str) -> None:
    (placed,) = read_placements(listed(tmp_path, row, header=header), unit)
    assert (placed.x, placed.y, placed.rotation) == pytest.approx((0.020, -0.010, math.pi / 2))


def test_a_unit_is_never_guessed(tmp_path: Path) -> None:
    path = listed(tmp_path, "R1,20,-10", header="designator,x,y")
    assert "column 'x' says no unit; name it x_mm, or say --unit" in refusal(path)


def test_all_wrong_lines_are_listed(tmp_path: Path) -> None:
    path = listed(
        tmp_path,
        "R1,20,-10,90,top,0603",
        "R2,here,-10,90,top,0603",
        "U3,0,0,0,bottom,QFN",
        "R1,5,5,0,top,0603",
        ",1,2,0,side,",
    )
    first, *lines = refusal(path).splitlines()
    assert first == f"{path}: 4 lines are wrong"
    assert [line.split(":")[0].strip() for line in lines] == [f"line {k}" for k in (3, 4, 5, 6)]
    assert "column x_mm: 'here' is not a number" in lines[0]
    assert "U3 is on the underside" in lines[1]
    assert "'R1' is there already, in line 2" in lines[2]
    assert "no designator" in lines[3]
    assert "neither 'top' nor 'bottom'" in lines[3]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        (HEADER + "\n", "names no target"),
        ("designator,y_mm\nR1,2\n", "no column for x"),
        ("designator,x_mm,y_mm\nR1,nan,2\n", "'nan' is not a number"),
        ("designator,x_mm,y_mm\nR1,1\n", "'' is not a number"),
    ],
)
def test_other_bad_lists(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "list.csv"
    path.write_text(text)
    assert says in refusal(path)


def test_no_file(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "nothing.csv")


@pytest.mark.parametrize("code", EIA_MM)
def test_sizes_by_code(code: str) -> None:
    """The code is the size in hundredths of an inch."""
    width, depth = package_size(f"C_{code}_HandSolder")
    assert width == pytest.approx(int(code[:2]) * 0.254e-3, abs=0.16e-3)
    assert depth == pytest.approx(int(code[2:]) * 0.254e-3, abs=0.16e-3)


def test_other_sizes() -> None:
    assert package_size("QFN-32_5x6mm_P0.5mm") == pytest.approx((0.005, 0.006))
    assert package_size("SOIC-8") == (POINT, POINT)


def test_a_target_is_as_high_as_what_is_there(tmp_path: Path) -> None:
    field = heights_of(board(component("C1", "capacitor", 10, 5, (6.3, 6.3, 7.7))))
    path = listed(tmp_path, "A,10,5,0,top,4x4mm", "B,-20,5,90,top,4x2mm")
    on_can, on_board = placement_features(path, read_placements(path), field)
    np.testing.assert_allclose(on_can.points[:, 2], 0.0077, atol=1e-6)
    np.testing.assert_allclose(on_board.points[:, 2], 0)
    np.testing.assert_allclose(np.ptp(on_board.corners, axis=0), [0.002, 0.004, 0], atol=1e-9)


def test_targets_off_the_board_are_all_listed(tmp_path: Path) -> None:
    path = listed(tmp_path, "A,10,5,0,top,", "B,500,5,0,top,", "C,0,-300,0,top,")
    with pytest.raises(InputError) as caught:
        placement_features(path, read_placements(path), heights_of(board()))
    assert [line.split(":")[0].strip() for line in str(caught.value).splitlines()[1:]] == [
        "line 3", "line 4",
    ]  # fmt: skip
