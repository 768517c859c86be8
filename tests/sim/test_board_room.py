"""Where there is room: neighbours, markers, edges and what carries are all in the way."""

import math
from dataclasses import replace

import pytest

from aoicell.board import BoardDesign, Component, MarkerDesign
from aoicell.sim.board_room import FURTHER, Room, carried, hidden_share


def part(id: str, x: float, y: float, kind: str = "chip", on: str = "", **size: float) -> Component:
    at = {"width": 0.010, "depth": 0.006, "height": 0.002, "z": 0.0, "rotation": 0.0} | size
    return Component(id=id, kind=kind, x=x, y=y, label="", on=on, **at)


MARKER = MarkerDesign("M1", "cross", -0.03, -0.02, 5e-4, 0.0, 0.020, 0.012, "positioning")


def board(*parts: Component) -> BoardDesign:
    return BoardDesign("test", (0.1, 0.08, 0.002), (0, 0.2, 0.1), parts, (MARKER,))


A, B = part("A", 0.0, 0.0), part("B", 0.020, 0.0)


@pytest.mark.parametrize(
    ("x", "y", "turn", "free"),
    [
        (0.0, 0.0, 0.0, True),  # its own place
        (0.0098, 0.0, 0.0, True),
        (0.00995, 0.0, 0.0, False),  # nearer to B than the clearance
        (0.0098, 0.0, 0.3, False),  # turned into it
        (0.02, 0.0062, 0.0, True),
        (-0.016, -0.013, 0.0, False),  # on the marker
        (-0.0148, -0.013, 0.0, True),
        (0.0, 0.0369, 0.0, True),
        (0.0, 0.0371, 0.0, False),  # over the edge
    ],
)
def test_neighbours_markers_and_edges_are_in_the_way(
    x: float, y: float, turn: float, free: bool
) -> None:
    moved = replace(A, x=x, y=y, rotation=turn)
    assert Room(board(A, B)).free([moved]) is free


def test_the_places_of_what_was_moved_are_taken_old_and_new() -> None:
    room = Room(board(A, B))
    away = replace(B, x=0.04, y=0.02)
    room.take(away)
    assert not room.free([replace(A, x=0.02)])
    assert not room.free([replace(A, x=0.04, y=0.02)])
    assert room.free([replace(B, x=0.039, y=0.02)]), "it is not in its own way"


def test_what_stands_out_may_do_so_and_hardly_more() -> None:
    plug = part("J", 0.0, 0.039, "connector")  # 2 mm beyond the edge at +y
    room = Room(board(plug))
    assert room.free([plug])
    assert room.free([replace(plug, y=plug.y + 0.9 * FURTHER)])
    assert not room.free([replace(plug, y=plug.y + 1.1 * FURTHER)])


def test_a_round_part_has_room_to_turn() -> None:
    screw = part("H", 0.0, 0.0, "screw", width=0.007, depth=0.007)
    chip = part("U", 0.0087, 0.0)  # 0.2 mm beside it
    room = Room(board(screw, chip))
    assert room.free([replace(screw, rotation=math.pi / 4)])
    square = replace(screw, kind="inductor")
    assert not Room(board(square, chip)).free([replace(square, rotation=math.pi / 4)])


def stack() -> tuple[Component, Component]:
    low = part("L", 0.0, 0.0)
    return low, part("T", 0.001, 0.0, "label", "L", width=0.005, depth=0.003, z=0.002)


def test_what_stands_on_a_part_stays_on_it() -> None:
    low, top = stack()
    room = Room(board(low, top))
    assert room.free([replace(top, x=0.0024)])
    assert not room.free([replace(top, x=0.0026)]), "it would hang over the edge of its carrier"
    both = [replace(low, x=0.01), replace(top, x=0.011)]
    assert room.free(both)
    assert not room.free([both[0], top]), "the carrier went away from below it"


def test_a_larger_part_goes_on_covering_what_carries_it() -> None:
    low = part("L", 0.0, 0.0)
    cooler = part("T", 0.0, 0.0, "heatsink", "L", width=0.014, depth=0.010, z=0.002)
    room = Room(board(low, cooler))
    assert room.free([replace(cooler, x=0.0019)])
    assert not room.free([replace(cooler, x=0.0021)])


def test_what_is_carried_directly_or_not() -> None:
    low, top = stack()
    dot = part("D", 0.001, 0.0, "label", "T", width=0.001, depth=0.001)
    whole = board(dot, low, top, B)
    assert [c.id for c in carried(whole, "L")] == ["D", "T"]
    assert carried(whole, "B") == ()


def test_the_hidden_share_is_that_of_the_area() -> None:
    low, top = stack()
    assert hidden_share(board(low, top), low) == pytest.approx(
        0.005 * 0.003 / (0.010 * 0.006), abs=0.02
    )
    turned = [replace(c, rotation=1.0) for c in (low, replace(top, x=low.x))]
    assert hidden_share(board(*turned), turned[0]) == pytest.approx(0.25, abs=0.02)
    assert hidden_share(board(low, top), top) == 0
