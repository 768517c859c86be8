"""What a reference may hold, and what is made of it."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.errors import InputError
from aoicell.inspection import Reference, ViewInspection, inspect_view, register_2d
from aoicell.nominal import Nominal
from aoicell.transforms import distance_deg, translation
from inspection.flat_boards import (
    CAMERA,
    T_CAMERA_BOARD,
    Flat,
    flat_drawing,
    painted,
    photograph,
)
from inspection.scenes import MISSING, SHIFTED, WASHER_AT, Look, called, is_finite


def test_a_reference_needs_a_picture() -> None:
    with pytest.raises(InputError, match="reference V9: it holds no picture"):
        Reference("V9", (), T_CAMERA_BOARD, CAMERA)


@pytest.mark.parametrize("name", ["bare", "numbers", "heights"])
def test_a_drawing_is_of_the_cameras_size(flat: Flat, name: str) -> None:
    drawing = flat_drawing(flat.board, flat.reference.images[0])
    cut = replace(drawing, **{name: getattr(drawing, name)[:, :-1]})
    with pytest.raises(InputError, match=rf"V9: the drawing's {name} is \(900, 1199\)"):
        Reference("V9", flat.reference.images, T_CAMERA_BOARD, CAMERA, drawing=cut)


def test_an_empty_picture_leaves_the_design_where_it_was_taken_to_be(flat: Flat) -> None:
    black = np.zeros_like(flat.reference.images[0])
    reference = Reference("black", (black,), T_CAMERA_BOARD, CAMERA)
    T = register_2d(black, reference, flat.board).T_camera_reference
    assert T.isApprox(T_CAMERA_BOARD, 1e-9)


def test_a_reference_has_one_virtual_image(flat: Flat) -> None:
    images = flat.reference.images * 2
    with pytest.raises(InputError, match="reference V9: 2 virtual images"):
        Reference("V9", images, T_CAMERA_BOARD, CAMERA, virtual=True)


def test_pictures_are_grey_and_of_the_cameras_size(flat: Flat) -> None:
    good = flat.reference.images[0]
    for bad in (good[:-1], good.T, np.dstack([good] * 3)):
        with pytest.raises(InputError, match=r"reference V9: picture 2 is \(.*\(900, 1200\)"):
            Reference("V9", (good, bad), T_CAMERA_BOARD, CAMERA)


@pytest.mark.parametrize("off", [(0.6e-3, 0.0), (-0.3e-3, 0.5e-3), (2.5e-3, -2e-3)])
def test_the_design_is_laid_where_the_parts_are(flat: Flat, off: tuple[float, float]) -> None:
    """A calibrated pose is off by as much as its marker is glued on elsewhere."""
    estimate = T_CAMERA_BOARD * translation(*off)
    reference = Reference("off", flat.reference.images, estimate, CAMERA)
    T = register_2d(flat.reference.images[0], reference, flat.board).T_camera_reference
    error = T.actInv(T_CAMERA_BOARD)
    assert np.hypot(*error.translation[:2]) < 0.15e-3
    assert distance_deg(T, T_CAMERA_BOARD) < 0.15


def test_golden_samples_need_not_lie_alike(flat: Flat) -> None:
    """The second board lay elsewhere; parts are found against the first's place."""
    second = photograph(flat.plane, T_CAMERA_BOARD * translation(2e-3, -1e-3), seed=11)
    reference = Reference("two", (*flat.reference.images, second), T_CAMERA_BOARD, CAMERA)
    moved = {"U7": (0.5e-3, 0.0, 0.0)}
    new = photograph(painted(flat.board, moved, ("U2",)), seed=12)
    inspection = inspect_view(new, reference, flat.board)
    assert sorted(called(inspection)) == ["U2", "U7"]
    assert inspection.findings["U7"].shift == pytest.approx((0.5e-3, 0), abs=0.06e-3)
    assert inspection.registration.moved_px < 0.5


def test_a_golden_sample_that_does_not_register_is_left_out(flat: Flat) -> None:
    black = np.zeros_like(flat.reference.images[0])
    reference = Reference("black", (*flat.reference.images, black), T_CAMERA_BOARD, CAMERA)
    good = inspect_view(photograph(flat.plane, seed=13), reference, flat.board)
    assert called(good) == []
    spoilt = photograph(painted(flat.board, missing=("U2",)), seed=14)
    assert called(inspect_view(spoilt, reference, flat.board)) == ["U2"]


@pytest.fixture(scope="module")
def with_two(taught: Look, golden: Look, spoilt: Look, nominal: Nominal) -> ViewInspection:
    """The server board with defects against two golden samples."""
    images = (taught.grey, golden.grey)
    reference = Reference("V3", images, taught.T_camera_board, taught.camera)
    return inspect_view(spoilt.grey, reference, nominal.board)


def test_two_golden_samples_of_the_server_board(with_two: ViewInspection) -> None:
    assert with_two.registration.state == "registered"
    assert is_finite(with_two)
    assert {*MISSING, *SHIFTED} <= set(called(with_two))
    for id, shift in SHIFTED.items():
        assert with_two.findings[id].shift == pytest.approx(shift, abs=0.15e-3)
    assert any(np.hypot(*np.subtract(f.place, WASHER_AT)) < 2e-3 for f in with_two.foreign)


def test_another_sample_makes_no_more_false_calls(
    with_two: ViewInspection, inspected: ViewInspection
) -> None:
    assert len(called(with_two)) <= len(called(inspected)) + 1
