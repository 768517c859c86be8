"""A populated board: what is on it, what is true of it, and what varies without being wrong."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from aoicell.board import BoardDesign, Component
from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.sim.as_built import Surfaces, plain_surfaces
from aoicell.sim.board_geometry import board_parts
from aoicell.sim.defects import Defect, draw_defects
from aoicell.sim.drawing import draw
from aoicell.sim.population import (
    PLACEMENT,
    Scatter,
    Spread,
    draw_scatter,
    populated,
)
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World
from aoicell.transforms import translation


@pytest.fixture(scope="module")
def board(nominal: Nominal) -> BoardDesign:
    return nominal.board


def test_without_anything_the_board_is_as_designed(board: BoardDesign) -> None:
    population = populated(board)
    assert population.board == board
    assert population.parts == board_parts(board)
    assert len(population.good) == len(board.components)
    taught = replace(plain_surfaces(), heights={"C1": 1e-4}, brightness={"C1": 0.9})
    assert population.surfaces(taught) == taught


def test_the_records_are_what_is_true(board: BoardDesign) -> None:
    ball = Component("BALL", "foreign", 0, 0, 0, 0, 1e-3, 1e-3, 1e-3, "solder ball")
    smaller = replace(board.component("C7"), width=5e-3, depth=5e-3)
    defects = (
        Defect("missing", "R1"),
        Defect("shifted", "U43", (3e-4, -2e-4)),
        Defect("rotated", "U9", rotation=-0.2),
        Defect("swapped_polarity", "BT1", rotation=np.pi),
        Defect("wrong_part", "C7", part=smaller),
        Defect("foreign_object", "BALL", (0.012, 0.02), 0.4, part=ball),
    )
    population = populated(board, defects, draw_scatter(board, 0, 0, 0))
    there = {c.id: c for c in population.board.components}
    assert "R1" not in there
    assert population.displacement("U43") == (pytest.approx((3e-4, -2e-4)), 0)
    assert population.displacement("U9") == ((0, 0), pytest.approx(-0.2))
    assert abs(population.displacement("BT1")[1]) == pytest.approx(np.pi)
    assert there["C7"] == smaller
    assert (there["BALL"].x, there["BALL"].y, there["BALL"].rotation) == (0.012, 0.02, 0.4)
    wrong = {"R1", "U43", "U9", "BT1", "C7"}
    assert set(population.good) == {c.id for c in board.components} - wrong
    assert set(population.parts) == set(there)
    with pytest.raises(InputError, match="no component 'R1'"):
        population.displacement("R1")


def test_a_tombstone_stands_where_its_record_says(board: BoardDesign) -> None:
    for sign in (1, -1):
        at = board.component("C36")  # turned by 90 degrees: its +x end is at +y
        population = populated(board, [Defect("tombstoned", "C36", (0.0, sign * at.width / 2))])
        centres = np.array([part.centre for part in population.parts["C36"]])
        np.testing.assert_allclose(centres[:, 0], at.x, atol=1e-12)
        np.testing.assert_allclose(centres[:, 1], at.y + sign * at.width / 2, atol=5e-5)
        top = max(part.centre[2] + part.half_size[2] for part in population.parts["C36"])
        assert top == pytest.approx(at.width)


def test_contradictions_are_named(board: BoardDesign) -> None:
    with pytest.raises(InputError, match="no component 'R99'"):
        populated(board, [Defect("missing", "R99")])
    with pytest.raises(InputError, match="R1: it has two defects, missing and shifted"):
        populated(board, [Defect("missing", "R1"), Defect("shifted", "R1", (1e-3, 0))])
    with pytest.raises(InputError, match="HS1: it stands on CPU1, which is missing"):
        populated(board, [Defect("missing", "CPU1")])


# ---- what varies -------------------------------------------------------------------------------


def test_scatter_has_the_stated_spread(board: BoardDesign) -> None:
    scatters = [draw_scatter(board, 0, 0, k) for k in range(60)]
    for kind in ("resistor", "connector", "label"):
        ids = [c.id for c in board.components if c.kind == kind]
        x = np.array([s.offsets[id] for s in scatters for id in ids])
        assert x.std(axis=0) == pytest.approx([PLACEMENT[kind]] * 2, rel=0.15)
        assert np.abs(x).max() <= 3 * PLACEMENT[kind]
    ends = [s.turns["J6"] * board.component("J6").width / 2 for s in scatters]
    assert np.std(ends) == pytest.approx(PLACEMENT["connector"], rel=0.3)
    tones = [s.brightness["R1"] for s in scatters]
    assert np.std(tones) == pytest.approx(0.05, rel=0.3)
    assert np.ptp([s.turns["H1"] for s in scatters]) > 5, "a screw stops where it likes"


def test_a_lot_is_of_one_brightness(board: BoardDesign) -> None:
    tones = draw_scatter(board, 0, 0, 0).brightness
    assert tones["R1"] == tones["R2"]
    assert len({tones[id] for id in ("R1", "C1", "L1", "U1")}) == 4


def test_scatter_is_keyed_by_component_and_trial(board: BoardDesign) -> None:
    fewer = replace(board, components=board.components[40:80])
    whole, part = (draw_scatter(b, 1, 2, 3) for b in (board, fewer))
    assert all(whole.offsets[id] == offset for id, offset in part.offsets.items())
    assert draw_scatter(board, 1, 2, 4).offsets != whole.offsets
    assert draw_scatter(board, 1, 2, -1).offsets != whole.offsets
    still = Spread(placement={}, screws=False, brightness=0, height=0)
    assert populated(board, (), draw_scatter(board, 1, 2, 3, still)).board == board


@pytest.mark.parametrize("trial", [-1, 0, 1])
def test_the_shipped_board_has_room_for_its_scatter(board: BoardDesign, trial: int) -> None:
    scatter = draw_scatter(board, 0, 0, trial)
    population = populated(board, (), scatter)
    for c in board.components:
        shift, turn = population.displacement(c.id)
        if not c.on:
            assert shift == pytest.approx(scatter.offsets[c.id], abs=1e-12), c.id
            assert turn == pytest.approx(scatter.turns[c.id], abs=1e-12), c.id


def test_what_stands_on_a_part_scatters_with_it(board: BoardDesign) -> None:
    turn, offset = 1e-3, (1e-4, -5e-5)
    scatter = Scatter({"SLOT_A1": offset, "DIMM_A1": (0.0, 2e-5)}, {"SLOT_A1": turn})
    population = populated(board, (), scatter)
    assert population.displacement("SLOT_A1") == (pytest.approx(offset), pytest.approx(turn))
    expected = (offset[0], offset[1] + 2e-5)
    assert population.displacement("DIMM_A1") == (pytest.approx(expected), pytest.approx(turn))


def test_scatter_never_pushes_a_part_into_another(board: BoardDesign) -> None:
    population = populated(board, (), Scatter({"R14": (0.0, 2.5e-3), "R15": (1e-4, 0.0)}))
    assert population.displacement("R14") == ((0, 0), 0)
    assert population.displacement("R15")[0] == pytest.approx((1e-4, 0))


def test_heights_and_brightness_are_relative_to_the_taught_board(board: BoardDesign) -> None:
    taught = Surfaces(heights={"C1": 1e-4}, brightness={"C1": 0.9}, dust=0.1, seed=(3, 4))
    scatter = Scatter(heights={"C1": 2e-5, "C2": 1e-5}, brightness={"C1": 1.1, "C2": 0.8})
    now = populated(board, (), scatter).surfaces(taught)
    assert now.heights == pytest.approx({"C1": 1.2e-4, "C2": 1e-5})
    assert now.brightness == pytest.approx({"C1": 0.99, "C2": 0.8})
    assert (now.dust, now.seed) == (0.1, (3, 4))


# ---- in the world ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def world(nominal: Nominal) -> Iterator[World]:
    world = World(nominal, draw(nominal, TYPICAL, seed=0))
    yield world
    world.close()


def over_the_board(world: World) -> None:
    """Bring the camera over U26, the way it looks at home."""
    chip, nominal = world.nominal.board.component("U26"), world.nominal
    pose = nominal.arm.fk(nominal.q_home)
    above = world.T_base_board.act(np.array([chip.x, chip.y, 0.0]))
    pose.translation[:2] += above[:2] - world.T_base_body("hand").translation[:2]
    world.arrive(nominal.arm.ik(pose, nominal.q_home))


def test_a_population_changes_the_board_and_nothing_else(world: World, board: BoardDesign) -> None:
    """Bit for bit: no defect and no scatter, and back to the taught board."""

    def look() -> bytes:
        world.begin(3)
        over_the_board(world)
        return world.picture("hand").tobytes()

    taught, clock, model = look(), world.clock, world.model
    as_designed = populated(board)
    world.populate(as_designed)
    assert look() == taught
    assert world.model is not model
    model = world.model
    world.populate(as_designed)
    assert world.model is model, "the same again costs nothing"
    defects = draw_defects(board, np.random.default_rng(0), 12)
    world.populate(populated(board, defects, draw_scatter(board, 0, 0, 3)))
    assert look() != taught
    assert world.clock == clock
    world.populate(None)
    assert look() == taught


def test_posture_camera_and_poses_outlive_a_population(world: World, nominal: Nominal) -> None:
    moved = world.geometry.T_flange_camera * translation(0.01)
    world.begin(0)
    world.arrive(nominal.q_home + 0.02)
    world.change_camera(moved, world.geometry.cameras["hand"])
    before, hulls = world.truth(), world.contacts()
    qpos = world.data.qpos.copy()
    world.populate(
        populated(nominal.board, draw_defects(nominal.board, np.random.default_rng(1), 5))
    )
    after = world.truth()
    np.testing.assert_array_equal(after.T_base_camera.homogeneous, before.T_base_camera.homogeneous)
    np.testing.assert_array_equal(after.T_base_board.homogeneous, before.T_base_board.homogeneous)
    np.testing.assert_array_equal(world.data.qpos, qpos)
    assert world.contacts() == hulls


def test_a_defect_shows_where_it_is_and_nowhere_else(world: World, nominal: Nominal) -> None:
    """A missing chip changes its own pixels only: the picture before lens and noise."""
    world.populate(None)
    world.begin(0)
    world.change_camera(
        world.as_built.geometry.T_flange_camera, world.as_built.geometry.cameras["hand"]
    )
    over_the_board(world)
    chip = nominal.board.component("U26")
    before = world.pinhole_picture("hand").astype(int)
    world.populate(populated(nominal.board, [Defect("missing", "U26")]))
    changed = np.argwhere(np.abs(world.pinhole_picture("hand") - before).max(axis=2) > 8)[:, ::-1]
    assert len(changed) > 500
    T = world.truth().T_camera_board
    width, height, focal = world._cameras["hand"].pinhole
    corners = np.array([[*c, z] for c in chip.footprint for z in (0.0, chip.top)])
    at = np.array([T.act(corner) for corner in corners])
    uv = focal * at[:, :2] / at[:, 2:] + [(width - 1) / 2, (height - 1) / 2]
    assert np.all(changed >= uv.min(axis=0) - 2)
    assert np.all(changed <= uv.max(axis=0) + 2)
