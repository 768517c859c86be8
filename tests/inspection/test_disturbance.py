"""Where a picture differs because of a part that moved."""

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.board import BoardDesign
from aoicell.inspection.disturbance import MARGIN_PX, Area, disturbed
from aoicell.inspection.inspect import STANDARD
from aoicell.inspection.matching import Place
from aoicell.inspection.standard import Standard, standard_of
from inspection.flat_boards import CAMERA, SIZE_MM, T_CAMERA_BOARD, flat_reference, painted


@pytest.fixture(scope="module")
def standard() -> Standard:
    design: BoardDesign = board(
        component("LBL1", "label", -20, 10, (9, 6, 0.1)),
        component("J1", "connector", 25, 10, (9, 6, 1.0)),
        component("C1", "capacitor", 0, -25, (9, 6, 6.0)),
        size_mm=SIZE_MM,
    )
    return standard_of(flat_reference(painted(design)), design, STANDARD)


def area(standard: Standard, id: str, place: Place | None, thrown: bool = False) -> Area:
    return disturbed(standard.tools[id].template, place, standard, thrown)


def covers(found: Area, x: float, y: float, z: float = 0.0) -> bool:
    [[u, v]] = np.rint(CAMERA.project([[x, y, z]], T_CAMERA_BOARD)).astype(int)
    rows, columns = found.window
    inside = rows.start <= v < rows.stop and columns.start <= u < columns.stop
    return bool(inside and found.mask[v - rows.start, u - columns.start])


def test_it_holds_the_old_place_and_the_new_one(standard: Standard) -> None:
    moved = area(standard, "LBL1", Place((0.012, 0.0), 0.0))
    assert covers(moved, -0.020, 0.010)
    assert covers(moved, -0.008, 0.010)
    assert not covers(moved, -0.008, 0.016)
    lost = area(standard, "LBL1", None)
    assert covers(lost, -0.020, 0.010)
    assert not covers(lost, -0.008, 0.010)


def test_a_part_throws_no_farther_than_it_is_high(standard: Standard) -> None:
    """A label throws nothing, so what lies beside one that is gone does not belong to it."""
    grown = {}
    for id in ("LBL1", "J1", "C1"):
        plain, thrown = (area(standard, id, None, which) for which in (False, True))
        grown[id] = plain.window[0].start - thrown.window[0].start
    assert grown["LBL1"] == 0
    assert grown["J1"] == 4  # px: 1 mm
    assert grown["C1"] > grown["J1"]
    assert grown["C1"] < 3 * MARGIN_PX
