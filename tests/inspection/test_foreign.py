"""What does not belong on the board is found where it lies."""

import numpy as np
import pytest

from aoicell.inspection import Reference, ViewInspection, inspect_view
from aoicell.transforms import from_twist
from inspection.flat_boards import (
    CAMERA,
    T_CAMERA_BOARD,
    Array,
    Flat,
    painted,
    photograph,
    pixels,
)
from inspection.scenes import WASHER, WASHER_AT, called, is_finite

PLACES = ((-0.051, 0.033), (0.017, -0.034), (0.053, 0.031))  # between the parts


def littered(plane: Array, place: tuple[float, float], size: float, grey: float) -> Array:
    """The painted board with a square of a size (m) on it."""
    dirty = plane.copy()
    (left, low), (right, high) = (
        np.rint(pixels(np.array(place) + side * size / 2)).astype(int) for side in (-1, 1)
    )
    dirty[low:high, left:right] = grey
    return dirty


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("grey", [20.0, 200.0])
def test_an_object_is_found_where_it_lies(
    flat: Flat, place: tuple[float, float], grey: float
) -> None:
    """Darker or brighter than the board, which has moved and turned."""
    T = T_CAMERA_BOARD * from_twist([1e-3, 2e-3, 0, 0, 0, -0.02])
    new = photograph(littered(flat.plane, place, 3e-3, grey), T, seed=8)
    inspection = inspect_view(new, flat.reference, flat.board)
    assert len(inspection.foreign) == 1
    [found] = inspection.foreign
    assert found.place == pytest.approx(place, abs=0.4e-3)
    assert 2e-3 < found.size < 6e-3  # of its box in the picture, which is turned against it
    assert found.confidence > 0.9
    assert called(inspection) == []
    left, top, right, bottom = found.area_px
    [[u, v]] = CAMERA.project([[*place, 0]], T_CAMERA_BOARD)
    assert left < u < right
    assert top < v < bottom


def test_a_crumb_on_the_edge_of_print_is_found(flat: Flat) -> None:
    """Print that lies a little off is brighter on one side and darker on the other, not in sum."""
    plane = flat.plane.copy()
    [[left, low], [right, high]] = np.rint(pixels(np.array([[-0.06, 0.033], [-0.04, 0.0334]])))
    plane[int(low) : int(high), int(left) : int(right)] = 140.0
    reference = Reference("flat", (photograph(plane),), T_CAMERA_BOARD, CAMERA)
    T = T_CAMERA_BOARD * from_twist([1e-3, 2e-3, 0, 0, 0, -0.02])
    clean, crumbed = (
        inspect_view(photograph(painted_, T, 8), reference, flat.board)
        for painted_ in (plane, littered(plane, (-0.051, 0.0334), 0.6e-3, 170.0))
    )
    assert clean.foreign == ()
    assert [f.place for f in crumbed.foreign] == [pytest.approx((-0.051, 0.0334), abs=0.6e-3)]


def test_what_lies_beside_a_flat_part_that_is_gone_is_found(flat: Flat) -> None:
    """It is no shadow of that: a part throws none farther than it is high."""
    chip = flat.board.component("U10")
    place = (chip.x - chip.width / 2 - 2.0e-3, chip.y)
    plane = littered(painted(flat.board, missing=("U10",)), place, 1.2e-3, 200.0)
    inspection = inspect_view(photograph(plane, seed=8), flat.reference, flat.board)
    assert called(inspection) == ["U10"]
    assert [f.place for f in inspection.foreign] == [pytest.approx(place, abs=0.6e-3)]


def test_a_clean_board_has_none(flat: Flat) -> None:
    T = T_CAMERA_BOARD * from_twist([1e-3, 2e-3, 0, 0, 0, -0.02])
    assert inspect_view(photograph(flat.plane, T, 9), flat.reference, flat.board).foreign == ()


def test_what_was_there_before_is_none(flat: Flat) -> None:
    """Only its absence is noticed: something differs there."""
    dirty = littered(flat.plane, PLACES[0], 3e-3, 200.0)
    reference = Reference("dirty", (photograph(dirty, seed=1),), T_CAMERA_BOARD, CAMERA)
    same = inspect_view(photograph(dirty, seed=2), reference, flat.board)
    assert same.foreign == ()
    clean = inspect_view(photograph(flat.plane, seed=2), reference, flat.board)
    assert [f.place for f in clean.foreign] == [pytest.approx(PLACES[0], abs=0.4e-3)]


def test_what_lies_on_a_part_is_found_too(flat: Flat) -> None:
    """As something wrong with that part, or as an object on it."""
    chip = flat.board.component("U12")
    new = photograph(littered(flat.plane, (chip.x, chip.y), 4e-3, 230.0), seed=3)
    inspection = inspect_view(new, flat.reference, flat.board)
    near = [
        f for f in inspection.foreign if np.hypot(*np.subtract(f.place, (chip.x, chip.y))) < 5e-3
    ]
    assert called(inspection) == ["U12"] or (near and called(inspection) == [])


def test_a_shifted_part_is_none(flat: Flat) -> None:
    new = photograph(painted(flat.board, {"U12": (3e-3, 2e-3, 0.3)}), seed=4)
    inspection = inspect_view(new, flat.reference, flat.board)
    assert called(inspection) == ["U12"]
    assert inspection.foreign == ()


def test_a_washer_on_the_server_board(inspected: ViewInspection) -> None:
    near = [f for f in inspected.foreign if np.hypot(*np.subtract(f.place, WASHER_AT)) < 2e-3]
    assert len(near) == 1
    assert near[0].place == pytest.approx(WASHER_AT, abs=0.7e-3)
    assert near[0].size == pytest.approx(WASHER.width, abs=2e-3)
    assert len(inspected.foreign) <= 4
    assert is_finite(inspected)
