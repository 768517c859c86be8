"""A component list is told all that is wrong with it at once."""

from pathlib import Path

import pytest
from helpers.small_boards import ROWS, write_board

from aoicell.board import load_board
from aoicell.errors import InputError, ModelError
from aoicell.planning.list_check import load_checked


def test_a_good_list_is_read_as_ever(tmp_path: Path) -> None:
    folder = write_board(tmp_path)
    assert load_checked(folder) == load_board(folder)


def test_every_bad_line_is_named(tmp_path: Path) -> None:
    folder = write_board(
        tmp_path,
        *ROWS,
        "X1,chp,30,-30,0,5,5,1,,",
        "X2,chip,20,10,0,5,5,1,,",
        "X3,chip,49,0,0,5,5,1,,",
        "X4,chip,30,20,0,5,five,1,,",
        "X5,label,30,-30,0,3,3,0.2,,X1",
        "R1,resistor,-40,-30,0,1.6,0.8,0.5,,",
    )
    with pytest.raises(InputError) as caught:
        load_checked(folder)
    first, *lines = str(caught.value).splitlines()
    assert first == f"{folder / 'components.csv'}: 5 lines are wrong"
    assert "'chp' is no kind; did you mean 'chip'?" in lines[0]
    assert "X2 overlaps R1 (line 4)" in lines[1]
    assert "X3" in lines[2]
    assert "leaves the outline" in lines[2]
    assert "depth_mm: 'five' is not a number" in lines[3]
    assert "'R1' is there already" in lines[4]
    assert len(lines) == 5  # X5 stands on a part that is wrong itself


def test_what_is_no_fault_of_a_line_is_said_as_ever(tmp_path: Path) -> None:
    folder = write_board(tmp_path, toml='name = "x"\n')
    with pytest.raises(ModelError, match=r"board.toml: key 'size_mm' is missing"):
        load_checked(folder)
