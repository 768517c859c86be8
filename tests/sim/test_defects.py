"""Drawn defects are real ones: possible, visible, in their ranges, and true as recorded."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from aoicell.board import BoardDesign, Component, rectangles_overlap
from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.sim.board_turns import looks_alike
from aoicell.sim.defects import DEFECT_KINDS, Defect, DefectKind, draw_defects, moved
from aoicell.sim.population import populated
from aoicell.transforms import Array

BOARDS = 25


@pytest.fixture(scope="module")
def board(nominal: Nominal) -> BoardDesign:
    return nominal.board


@pytest.fixture(scope="module")
def boards(board: BoardDesign) -> list[tuple[Defect, ...]]:
    return [draw_defects(board, np.random.default_rng(k), 12) for k in range(BOARDS)]


def drawn(board: BoardDesign, kind: DefectKind, count: int, boards: int) -> list[Defect]:
    """Defects of one kind over many boards, without what was only carried along."""
    rng = np.random.default_rng(1)
    found = [d for _ in range(boards) for d in draw_defects(board, rng, count, (kind,))]
    return [d for d in found if not d.detail.startswith("with ")]


def test_the_same_stream_gives_the_same_defects(board: BoardDesign) -> None:
    first, again, other = (draw_defects(board, np.random.default_rng(k), 12) for k in (3, 3, 4))
    assert first == again
    assert first != other


def test_as_many_as_asked_for_one_a_component_of_every_kind(
    boards: list[tuple[Defect, ...]],
) -> None:
    assert all(len(defects) == 12 for defects in boards)
    assert all(len({d.component for d in defects}) == 12 for defects in boards)
    counts = Counter(d.kind for defects in boards for d in defects)
    expected = 12 * BOARDS / len(DEFECT_KINDS)
    assert set(counts) == set(DEFECT_KINDS)
    assert all(abs(n - expected) < 4 * np.sqrt(expected) for n in counts.values()), counts


def test_nothing_stands_in_another_on_a_marker_or_beyond_the_edge(
    board: BoardDesign, boards: list[tuple[Defect, ...]]
) -> None:
    """Checked with the board's own rule for overlaps, on what is there in the end."""
    plates = [m.plate() for m in board.markers]
    half = np.array(board.size[:2]) / 2
    for defects in boards:
        there = populated(board, defects).board
        changed = {d.component for d in defects}
        corners = {c.id: footprint(c) for c in there.components}
        on = {c.id: c.on for c in there.components}
        for id in changed & set(corners):
            for other, place in corners.items():
                related = other == id or other in stack(id, on) or id in stack(other, on)
                assert related or not rectangles_overlap(corners[id], place), (id, other)
            assert not any(rectangles_overlap(corners[id], plate) for plate in plates), id
            designed = np.abs(board.component(id).footprint) if id in on_design(board) else 0
            allowed = np.maximum(half, np.max(designed, axis=0) + 1e-3)
            assert np.all(np.abs(corners[id]) <= allowed + 1e-9), id


def footprint(c: Component) -> Array:
    """Round heads do not turn."""
    return (replace(c, rotation=0.0) if c.kind == "screw" else c).footprint


def stack(id: str, on: dict[str, str]) -> set[str]:
    below = set()
    while id := on.get(id, ""):
        below.add(id)
    return below


def on_design(board: BoardDesign) -> set[str]:
    return {c.id for c in board.components}


def test_shifts_keep_their_range_evenly_by_factor(board: BoardDesign) -> None:
    found = drawn(board, "shifted", 8, 40)
    shifts = [float(np.hypot(*d.shift)) for d in found]
    assert 0.1e-3 <= min(shifts) < 0.12e-3
    assert 4e-3 < max(shifts) <= 5e-3
    assert np.median(shifts) == pytest.approx(np.sqrt(0.1e-3 * 5e-3), rel=0.35)
    directions = np.array([d.shift for d in found]) / np.array(shifts)[:, None]
    assert np.abs(directions.mean(axis=0)).max() < 0.15


def test_rotations_keep_their_range_and_can_be_seen(board: BoardDesign) -> None:
    found = drawn(board, "rotated", 8, 40)
    turns = np.abs(np.degrees([d.rotation for d in found]))
    assert 1 <= turns.min() < 1.2
    assert 150 < turns.max() <= 180
    assert {np.sign(d.rotation) for d in found} == {-1, 1}
    for d in found:
        alike = 360 / looks_alike(board.component(d.component))
        rest = np.degrees(d.rotation) % alike
        assert min(rest, alike - rest) >= 1, d


@pytest.mark.parametrize(
    ("kind", "never"),
    [
        ("shifted", {"screw", "dimm_module", "socket"}),
        ("rotated", {"screw", "dimm_module", "socket"}),
        ("wrong_part", {"socket", "dimm_slot"}),
        ("missing", set()),
    ],
)
def test_defects_come_on_every_kind_that_they_make_sense_for(
    board: BoardDesign, kind: DefectKind, never: set[str]
) -> None:
    kinds = {board.component(d.component).kind for d in drawn(board, kind, 30, 12)}
    assert kinds == {c.kind for c in board.components} - never


def test_only_light_chip_parts_stand_up(board: BoardDesign) -> None:
    for d in drawn(board, "tombstoned", 20, 3):
        c = board.component(d.component)
        assert c.kind in ("resistor", "capacitor", "led")
        assert c.width <= 3.2e-3
        along = c.place(np.hypot(*d.shift), 0), c.place(-np.hypot(*d.shift), 0)
        assert any(np.allclose(end, (c.x + d.shift[0], c.y + d.shift[1])) for end in along)
        assert np.hypot(*d.shift) == pytest.approx(c.width / 2)


def test_a_swapped_polarity_shows(board: BoardDesign) -> None:
    found = [board.component(d.component) for d in drawn(board, "swapped_polarity", 40, 4)]
    assert {c.kind for c in found} == {"capacitor", "led", "chip", "battery", "connector"}
    assert all(looks_alike(c) == 1 for c in found)
    assert all(c.height > 3e-3 for c in found if c.kind == "capacitor"), "ceramics have none"


def test_what_is_under_something_is_not_the_defect(board: BoardDesign) -> None:
    for kind in DEFECT_KINDS:
        for d in drawn(board, kind, 20, 4):
            if kind not in ("missing", "foreign_object"):
                assert d.component not in ("CPU1", "CPU2", "U22", "U31")


def test_what_stands_on_a_missing_part_is_missing_too(board: BoardDesign) -> None:
    rng = np.random.default_rng(0)
    for _ in range(30):
        gone = {d.component for d in draw_defects(board, rng, 20, ("missing",))}
        assert all(c.id in gone for c in board.components if c.on in gone)


def two() -> BoardDesign:
    """A slot with what it carries, off the slot's middle."""
    slot = Component("S", "connector", 0.01, 0.0, 0.0, 0.0, 0.02, 0.006, 0.005, "HDR")
    label = Component("L", "label", 0.015, 0.0, 0.005, 0.0, 0.004, 0.003, 2e-4, "A", "S")
    return BoardDesign("two", (0.1, 0.08, 0.002), (0, 0.2, 0.1), (slot, label), ())


def test_what_stands_on_a_moved_part_moves_with_it() -> None:
    spare = replace(two().component("S"), id="X", x=-0.03)
    board = replace(two(), components=(*two().components, spare))
    pairs = (draw_defects(board, np.random.default_rng(k), 2, ("rotated",)) for k in range(50))
    slot, label = next(pair for pair in pairs if pair[0].component == "S")
    assert label.detail == "with S"
    assert slot.shift == (0, 0)
    assert label.rotation == slot.rotation
    turn = slot.rotation
    expected: Array = 0.005 * np.array([np.cos(turn) - 1, np.sin(turn)])
    np.testing.assert_allclose(label.shift, expected, atol=1e-12)


def test_one_more_defect_is_never_two() -> None:
    for seed in range(20):
        (defect,) = draw_defects(two(), np.random.default_rng(seed), 1, ("missing",))
        assert defect.component == "L", "the slot would take its label along"


def test_too_many_are_refused_with_what_there_is_room_for() -> None:
    with pytest.raises(InputError, match=r"board two: 3 defects of the kinds missing .* for 2"):
        draw_defects(two(), np.random.default_rng(0), 3, ("missing",))


def test_an_unknown_kind_is_named() -> None:
    with pytest.raises(InputError, match="'mising': did you mean 'missing'"):
        draw_defects(two(), np.random.default_rng(0), 1, ("mising",))  # type: ignore[arg-type]


def test_moved_turns_about_its_own_centre() -> None:
    c = replace(two().components[1], rotation=0.5)
    there = moved(c, (0.001, -0.002), 0.25)
    assert (there.x, there.y, there.rotation) == pytest.approx((0.016, -0.002, 0.75))
