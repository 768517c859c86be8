"""The print on the board and its components: what it shows, and where."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aoicell.board import BoardDesign, Component, load_board
from aoicell.sim.board_labels import label_image
from aoicell.sim.board_silkscreen import silkscreen_image

FOLDER = Path(__file__).parents[2] / "models" / "server_board"


@pytest.fixture(scope="module")
def board() -> BoardDesign:
    return load_board(FOLDER)


def test_a_label_is_paper_with_dark_print() -> None:
    label = Component("LBL1", "label", 0, 0, 0, 0, 0.05, 0.014, 0.0002, "S/N 1")
    image = label_image(label, pixels_per_mm=8)
    assert image.shape == (112, 400, 3)
    assert image.dtype == np.uint8
    assert np.median(image[:20]) > 200
    bars = image[80, :, 0] < 100
    assert np.count_nonzero(np.diff(bars.astype(int))) > 20
    other = label_image(replace(label, label="S/N 2"), pixels_per_mm=8)
    assert np.mean(image != other) > 0.02


def test_a_chip_is_printed_dark() -> None:
    chip = Component("U1", "chip", 0, 0, 0, 0, 0.021, 0.021, 0.0018, "AST2500 BMC")
    image = label_image(chip)
    assert np.median(image) < 60
    assert image.max() > 120


def test_the_silkscreen_is_the_board_seen_from_above(board: BoardDesign) -> None:
    image = silkscreen_image(board, 2.0)
    assert image.shape == (660, 840, 3)
    red, green, blue = image.reshape(-1, 3).mean(axis=0)
    assert green > 1.5 * red
    assert green > 1.2 * blue
    assert np.array_equal(image, silkscreen_image(board, 2.0))
    hole = board.component("H2")  # rear right: the pad's ring is at the upper right of the picture
    column, row = (hole.x + 0.21) * 2e3, (0.165 - hole.y) * 2e3
    assert image[round(row), round(column)].min() > 120
    assert row < 20
    assert column > 800
