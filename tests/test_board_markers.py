"""The same board with other markers: what they become, and what does not fit."""

import numpy as np
import pytest

from aoicell.board import rectangles_overlap, with_markers
from aoicell.board.design import BoardDesign
from aoicell.board.layout import MARKER_CLEARANCE
from aoicell.errors import InputError
from aoicell.nominal import Nominal


@pytest.fixture
def board(nominal: Nominal) -> BoardDesign:
    return nominal.board


def test_nothing_changes_when_nothing_is_asked_for(board: BoardDesign) -> None:
    assert with_markers(board) == board


@pytest.mark.parametrize(
    ("kind", "pitch", "codes"),
    [
        ("coded", 0.036, ["1", "2", "3", "1"]),
        ("apriltag", 0.048, ["0", "1", "2", "3"]),
        ("charuco", 0.036, ["0", "1", "2", "3"]),
    ],
)
def test_another_kind_on_the_same_squares(
    board: BoardDesign, kind: str, pitch: float, codes: list[str]
) -> None:
    changed = with_markers(board, kind)
    assert changed.components == board.components
    assert [m.code for m in changed.markers] == codes
    for old, new in zip(board.markers, changed.markers, strict=True):
        assert (new.id, new.x, new.y, new.size, new.role) == (
            old.id, old.x, old.y, old.size, old.role,
        )  # fmt: skip
        assert (new.kind, new.pitch) == (kind, pytest.approx(pitch))


def test_a_smaller_pitch_stays_on_the_square(board: BoardDesign) -> None:
    changed = with_markers(board, pitch=0.024)
    assert {(m.kind, m.size, m.pitch) for m in changed.markers} == {("cross", 0.060, 0.024)}


def test_a_larger_pitch_needs_a_larger_square_which_does_not_fit(board: BoardDesign) -> None:
    expected = r"marker M1 of 84 mm .* lies on J1, .*; markers of up to 61 mm fit"
    with pytest.raises(InputError, match=expected):
        with_markers(board, pitch=0.060)
    with_markers(board, size=0.061)
    with pytest.raises(InputError, match="markers of up to 61 mm fit"):
        with_markers(board, size=0.062)


def test_room_is_made_for_it(board: BoardDesign) -> None:
    changed = with_markers(board, pitch=0.060, make_room=True)
    ids = {component.id for component in changed.components}
    assert 0 < len(board.components) - len(ids) < 30
    assert all(c.on in ids for c in changed.components if c.on)
    for marker in changed.markers:
        plate = marker.plate()
        assert marker.size == pytest.approx(0.084)
        assert (np.abs(plate) <= np.array(board.size[:2]) / 2 + 1e-9).all()
        grown = marker.plate(MARKER_CLEARANCE)
        assert not any(rectangles_overlap(c.footprint, grown) for c in changed.components)


def test_what_stands_on_a_component_goes_with_it(board: BoardDesign) -> None:
    changed = with_markers(board, size=0.150, make_room=True)
    gone = {c.id for c in board.components} - {c.id for c in changed.components}
    assert any(c.on in gone for c in board.components)
    assert {c.id for c in board.components if c.on in gone} <= gone


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ({"kind": "cros"}, "marker kind 'cros': did you mean 'cross'"),
        ({"size": 0.060, "pitch": 0.060}, "60 mm do not fit into 60 mm; the square has to be 84"),
        ({"size": 0.350}, "a plate of 350 mm is larger than board server_board, 420 x 330 mm"),
    ],
)
def test_what_is_no_marker_is_refused(
    board: BoardDesign, asked: dict[str, float], expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        with_markers(board, **asked)  # type: ignore[arg-type]


def test_the_nominal_cell_takes_them(nominal: Nominal) -> None:
    changed = nominal.with_markers("coded")
    assert changed.marker_codes == {"M1": "1", "M2": "2", "M3": "3", "M4": "1"}
    assert nominal.marker_codes == dict.fromkeys(("M1", "M2", "M3", "M4"))
    assert changed.marker.print_image(60).shape == (60, 60)
    assert nominal.board.markers[0].kind == "cross"
    changed = nominal.with_markers(pitch=0.060, make_room=True)
    assert np.abs(changed.marker.crosses).max() == pytest.approx(0.030)
    T = changed.T_board_positioning
    np.testing.assert_allclose(T.translation[:2] * 1e3, [-168, 123])
