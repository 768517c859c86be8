"""The nominal twin draws the cell as designed: the same picture as an exact cell's."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np
import pytest

from aoicell.inspection.shown import BARE, MARKER, shown_by
from aoicell.nominal import Nominal
from aoicell.observation import to_grey
from aoicell.sim.cell import SimCell
from aoicell.sim.twin import NominalTwin
from aoicell.sim.world import World
from aoicell.transforms import Array, looking_at, rotation, translation

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]


@pytest.fixture(scope="module")
def twin(nominal: Nominal) -> Iterator[NominalTwin]:
    twin = NominalTwin(nominal)
    yield twin
    twin.close()


def test_it_has_no_seed_and_sees_no_truth() -> None:
    assert list(inspect.signature(NominalTwin).parameters) == ["nominal", "part"]
    assert list(inspect.signature(NominalTwin.render).parameters) == [
        "self", "T_base_camera", "T_base_board",
    ]  # fmt: skip


@pytest.mark.parametrize("view", ["overview", "V2", "V4"])
def test_it_draws_what_an_exact_cell_photographs(
    twin: NominalTwin,
    ideal_world: World,
    nominal: Nominal,
    taught_poses: TaughtPoses,
    view: str,
) -> None:
    ideal_world.arrive(taught_poses(nominal)[view])
    ideal_world.place_board(
        translation(0.02, -0.01) * nominal.T_base_board * rotation("z", np.radians(5))
    )
    real = SimCell(ideal_world, colour=True).capture().image
    truth = ideal_world.truth()
    virtual = twin.render(truth.T_base_camera, truth.T_base_board)
    assert virtual.shape == real.shape
    assert virtual.dtype == np.uint8
    difference = np.abs(virtual.astype(int) - real.astype(int)).max(axis=2)
    assert (difference > 4).mean() < 1e-3
    assert difference.mean() < 0.5


def test_the_board_is_where_it_is_said_to_be(twin: NominalTwin, nominal: Nominal) -> None:
    T_base_board = translation(0.03, 0.02) * nominal.T_base_board * rotation("z", 0.2)
    T_base_camera = T_base_board * nominal.T_board_positioning * nominal.check.T_target_camera
    (uv,) = nominal.marker.detect(to_grey(twin.render(T_base_camera, T_base_board)))
    T_camera_marker = T_base_camera.actInv(T_base_board * nominal.T_board_positioning)
    expected = nominal.cameras["hand"].project(nominal.marker.crosses, T_camera_marker)
    gaps = [np.abs(np.roll(uv, k, axis=0) - expected).max() for k in range(4)]
    assert min(gaps) < 0.05


def test_a_bare_board_differs_where_components_stand(twin: NominalTwin, nominal: Nominal) -> None:
    """Between them, and on its markers, it looks the same; shadows apart."""
    camera = nominal.cameras["hand"]
    T_base_board = nominal.T_base_board
    T_base_camera = T_base_board * looking_at((0.0, 0.0, 0.0), 0.6)
    pose = (T_base_camera, T_base_board)
    before = to_grey(twin.render(*pose))
    difference = np.abs(to_grey(twin.bare(*pose)).astype(int) - before)
    assert (to_grey(twin.render(*pose)) == before).all(), "and the components are back"
    shown = shown_by(nominal.board, camera, T_base_camera.actInv(T_base_board))
    parts = shown.numbers >= 0
    assert (difference[parts] > 4).mean() > 0.6
    assert (difference[shown.numbers == MARKER] > 4).mean() < 0.01
    assert (difference[shown.numbers == BARE] > 4).mean() < 0.1


def test_half_turned_is_the_board_with_every_part_the_other_way_round(
    twin: NominalTwin, nominal: Nominal
) -> None:
    """As a board that is designed so; print, pads and markers stay, and nothing of it remains."""
    T_base_board = nominal.T_base_board
    pose = (T_base_board * looking_at((-0.03, -0.09, 0.0), 0.3, (0.2, 0.1)), T_base_board)
    before = twin.render(*pose)
    turned = to_grey(twin.half_turned(*pose)).astype(int)
    assert (twin.render(*pose) == before).all()
    parts = tuple(replace(c, rotation=c.rotation + np.pi) for c in nominal.board.components)
    other = NominalTwin(replace(nominal, board=replace(nominal.board, components=parts)))
    try:
        difference = np.abs(to_grey(other.render(*pose)) - turned)
    finally:
        other.close()
    as_designed = np.abs(to_grey(before) - turned)
    assert (as_designed > 20).mean() > 0.003
    assert (difference > 20).mean() < 0.1 * (as_designed > 20).mean()


def test_its_solids_are_the_components_to_the_pixel(twin: NominalTwin, nominal: Nominal) -> None:
    """Boxes where components are boxes; a can leaves the corners of its box free."""
    camera, T_base_board = nominal.cameras["hand"], nominal.T_base_board
    T_base_camera = T_base_board * looking_at((-0.1, 0.1, 0.0), 0.4)
    T_camera_board = T_base_camera.actInv(T_base_board)
    numbers, depths = twin.solids(T_base_camera, T_base_board)
    shown = shown_by(nominal.board, camera, T_camera_board)
    shares = {}
    for kind in ("chip", "resistor", "capacitor", "connector"):
        which = [n for n, c in enumerate(nominal.board.components) if c.kind == kind]
        box, solid = np.isin(shown.numbers, which), np.isin(numbers, which)
        shares[kind] = (box & solid).sum() / box.sum()
    assert min(shares["chip"], shares["resistor"], shares["connector"]) > 0.8
    assert 0.6 < shares["capacitor"] < 0.9
    assert (numbers[shown.numbers == MARKER] == -1).all()
    chip = nominal.board.component("U23")
    middle = np.array([[chip.x, chip.y, chip.top]])
    [[u, v]] = np.rint(camera.project(middle, T_camera_board)).astype(int)
    assert nominal.board.components[numbers[v, u]].id == "U23"
    assert depths[v, u] == pytest.approx(T_camera_board.act(middle[0])[2], abs=5e-5)
