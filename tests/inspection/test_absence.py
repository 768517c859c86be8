"""A part that is not there."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.camera import Camera
from aoicell.inspection import Reference, ViewInspection, inspect_view
from aoicell.inspection.bare import bare_board
from aoicell.inspection.shown import shown_by
from aoicell.inspection.virtual_picture import Drawing
from aoicell.nominal import Nominal
from aoicell.sim.defects import Defect
from aoicell.sim.population import draw_scatter, populated
from aoicell.transforms import looking_at, translation
from inspection.flat_boards import T_CAMERA_BOARD, Flat, flat_drawing, painted, photograph
from inspection.scenes import MISSING, Scene, called, is_finite

GONE = ("U2", "U9", "U13")


@pytest.mark.parametrize("light", [0.8, 1.0, 1.2])
def test_a_bare_place_is_absent_in_any_light(flat: Flat, light: float) -> None:
    T = T_CAMERA_BOARD * translation(1e-3, 5e-4)
    new = photograph(painted(flat.board, missing=GONE), T, 6, light)
    inspection = inspect_view(new, flat.reference, flat.board)
    assert sorted(called(inspection)) == sorted(GONE)
    assert {inspection.findings[id].state for id in GONE} == {"absent"}
    assert all(inspection.findings[id].confidence > 0.9 for id in GONE)
    assert inspection.foreign == (), "a missing part leaves no foreign object"
    assert is_finite(inspection)


@pytest.mark.parametrize("tone", [0.6, 1.3])
def test_pads_are_bare_where_the_bare_board_is_known(flat: Flat, tone: float) -> None:
    """A drawn board has nobody's grey values, but pads and print where the real one has them."""
    everything = tuple(c.id for c in flat.board.components)
    drawn = photograph(painted(flat.board, missing=everything, padded=GONE), seed=9, light=tone)
    standard = photograph(painted(flat.board, padded=GONE))
    drawing = flat_drawing(flat.board, drawn)
    known = Reference("V", (standard,), T_CAMERA_BOARD, flat.reference.camera, drawing=drawing)
    other = {"U9": (0.0, 0.0, np.pi)}
    new = photograph(painted(flat.board, other, missing=("U2", "U13"), padded=GONE), seed=6)
    inspection = inspect_view(new, known, flat.board)
    assert sorted(called(inspection)) == sorted(GONE)
    assert {inspection.findings[id].state for id in ("U2", "U13")} == {"absent"}
    assert inspection.findings["U9"].state == "rotated", "something is there"
    unknown = inspect_view(new, replace(known, drawing=None), flat.board)
    assert {unknown.findings[id].state for id in ("U2", "U13")} == {"wrong_part"}


def test_a_drawn_board_without_print_is_no_obstacle(flat: Flat) -> None:
    """Nothing tells its light from the real one's but its level."""
    even = np.full_like(flat.reference.images[0], 90)
    known = replace(flat.reference, drawing=flat_drawing(flat.board, even))
    new = photograph(painted(flat.board, missing=GONE), seed=6)
    inspection = inspect_view(new, known, flat.board)
    assert sorted(called(inspection)) == sorted(GONE)
    assert {inspection.findings[id].state for id in GONE} == {"absent"}


def test_a_view_without_bare_board_does_without_the_drawn_one() -> None:
    camera, T = Camera.pinhole(1000.0, 320, 240), looking_at((0, 0, 0), 0.3).inverse()
    design = board(component("U1", "chip", 0, 0, (200, 200, 1)), size_mm=(210, 210))
    shown = shown_by(design, camera, T)
    plane = np.zeros((240, 320), np.float32)
    black = plane.astype(np.uint8)
    drawing = Drawing(black, black, black, shown.numbers, shown.heights)
    assert (shown.numbers == 0).all()
    assert bare_board(drawing, plane, shown) is None


def test_something_else_in_its_place_is_not_absent(flat: Flat, rng: np.random.Generator) -> None:
    """Two parts that were mixed up: there, but not what should be there."""
    a, b = (flat.board.component(id) for id in ("U6", "U8"))
    swapped = {
        "U6": (b.x - a.x, b.y - a.y, b.rotation - a.rotation),
        "U8": (a.x - b.x, a.y - b.y, a.rotation - b.rotation),
    }
    new = photograph(painted(flat.board, swapped), seed=7)
    inspection = inspect_view(new, flat.reference, flat.board)
    assert sorted(called(inspection)) == ["U6", "U8"]
    assert {inspection.findings[id].state for id in ("U6", "U8")} == {"wrong_part"}


@pytest.mark.parametrize("id", MISSING)
def test_a_missing_part_of_the_server_board_is_found(inspected: ViewInspection, id: str) -> None:
    """From a chip resistor to a coil, some of whose places look like what stood there."""
    assert inspected.findings[id].is_defect
    assert inspected.findings[id].confidence > 0.5
    assert inspected.findings[id].reason


def test_most_missing_parts_are_said_to_be_absent_or_wrong(inspected: ViewInspection) -> None:
    states = [inspected.findings[id].state for id in MISSING]
    assert set(states) <= {"absent", "wrong_part"}
    assert "absent" in states


@pytest.mark.parametrize("gone", ["A2", "A3"])
def test_what_is_seen_through_its_neighbours_is_not_missed_there(
    scene: Scene, reference: Reference, nominal: Nominal, gone: str
) -> None:
    """Between the chips of a memory module one sees the next; where that is gone, the board."""
    board = nominal.board
    defects = [Defect("missing", f"SLOT_{gone}"), Defect("missing", f"DIMM_{gone}")]
    spoilt = scene.look("V3", populated(board, defects, draw_scatter(board, 0, 0, 0)))
    inspection = inspect_view(spoilt.grey, reference, board)
    assert inspection.findings[f"DIMM_{gone}"].is_defect
    assert not [id for id in called(inspection) if id.startswith("DIMM") and gone not in id]
