"""Template login: where the markers are on the real board."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from aoicell.errors import Refused, TargetNotFound
from aoicell.nominal import Nominal
from aoicell.observation import Observation
from aoicell.pipeline import TaughtPictures, photograph_board
from aoicell.registration import (
    Template,
    component_points,
    designed_layout,
    measured_layout,
    register,
)
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.layout import Layout
from aoicell.transforms import SE3, apply, distance_mm

MARKER = CrossMarker()


@pytest.fixture(scope="module")
def world(nominal: Nominal) -> Iterator[World]:
    """Everything exact, except that the markers were stuck on by hand."""
    world = World(nominal, draw(nominal, Tolerances(marker_mm=0.5, marker_deg=0.5), seed=0))
    yield world
    world.close()


@pytest.fixture(scope="module")
def taught(world: World, nominal: Nominal) -> TaughtPictures:
    return photograph_board(SimCell(world), nominal)


@pytest.fixture(scope="module")
def pictures(taught: TaughtPictures) -> list[Observation]:
    return [taught.check, taught.overview, *(view.standard for view in taught.views)]


def expected(nominal: Nominal, observation: Observation) -> SE3:
    """T_camera_board as designed."""
    T_base_camera = observation.state.T_base_flange * nominal.T_flange_camera
    return T_base_camera.actInv(nominal.T_base_board)


def true_layout(world: World, fixed: str = "M1") -> Layout:
    """The markers' real places, in a frame that has `fixed` at its design place."""
    design = world.nominal.T_board_positioning
    to_design = design * world.geometry.Ts_board_marker[fixed].inverse()
    return {id: apply(to_design, world.marker_points(id, MARKER.crosses)) for id in design_ids()}


def design_ids() -> tuple[str, ...]:
    return ("M1", "M2", "M3", "M4")


def worst_mm(layout: Layout, other: Layout) -> float:
    return max(1e3 * np.linalg.norm(layout[id] - other[id], axis=1).max() for id in layout)


def test_moved_markers_are_measured(
    world: World, nominal: Nominal, pictures: list[Observation]
) -> None:
    design = designed_layout(nominal.board, MARKER)
    layout, sigma_px = measured_layout(
        [MARKER.detect(o.grey) for o in pictures], [expected(nominal, o) for o in pictures],
        design, nominal.cameras["hand"], fixed="M1",
    )  # fmt: skip
    assert worst_mm(design, true_layout(world)) > 0.5
    assert worst_mm(layout, true_layout(world)) < 0.02
    assert 2e-4 < sigma_px < 0.1
    np.testing.assert_array_equal(layout["M1"], design["M1"])


def test_the_design_is_as_drawn(nominal: Nominal) -> None:
    layout = designed_layout(nominal.board, MARKER)
    assert set(layout) == set(design_ids())
    # M1 at (-171, 124, 0.5), crosses 36 mm apart, clockwise from the top left
    np.testing.assert_allclose(
        layout["M1"] * 1e3,
        [[-189, 142, 0.5], [-153, 142, 0.5], [-153, 106, 0.5], [-189, 106, 0.5]],
    )


def test_a_marker_drawn_turned_is_turned_anticlockwise(nominal: Nominal) -> None:
    turned = replace(nominal.board.markers[0], rotation=np.radians(30))
    board = replace(nominal.board, markers=(turned,))
    side = np.diff(designed_layout(board, MARKER)["M1"][:2], axis=0)[0]
    np.testing.assert_allclose(side, 0.036 * np.array([np.cos(np.pi / 6), 0.5, 0]), atol=1e-12)


def test_registration_keeps_the_look_and_the_views(
    world: World, nominal: Nominal, taught: TaughtPictures
) -> None:
    layout, look = true_layout(world), taught.overview
    template = register(
        look, MARKER.detect(look.grey), taught.views, layout, nominal.cameras["hand"],
        expected(nominal, look),
    )  # fmt: skip
    assert isinstance(template, Template)
    assert template.look is look
    assert [view.id for view in template.views] == ["V1", "V2", "V3", "V4"]
    # the layout's frame stands on the real M1
    to_design = nominal.T_board_positioning * world.geometry.Ts_board_marker["M1"].inverse()
    true = world.truth_of(look).T_camera_board * to_design.inverse()
    assert distance_mm(template.taught.T_camera_target, true) < 0.05


def test_a_marker_out_of_the_taught_picture_is_named(
    nominal: Nominal, taught: TaughtPictures
) -> None:
    look = taught.check  # shows M1 alone
    with pytest.raises(
        TargetNotFound, match=r"1 of 4 markers found, 4 needed \(missing: M2, M3, M"
    ):
        register(
            look, MARKER.detect(look.grey), taught.views, designed_layout(nominal.board, MARKER),
            nominal.cameras["hand"], expected(nominal, look),
        )  # fmt: skip


def test_measuring_without_any_marker_in_sight_is_refused(
    nominal: Nominal, taught: TaughtPictures
) -> None:
    with pytest.raises(Refused):
        measured_layout(
            [[], []], [expected(nominal, taught.check)] * 2,
            designed_layout(nominal.board, MARKER), nominal.cameras["hand"], fixed="M1",
        )  # fmt: skip


def test_points_of_a_view_are_component_tops_or_where_the_axis_meets_the_board(
    nominal: Nominal, taught: TaughtPictures
) -> None:
    camera, T = nominal.cameras["hand"], expected(nominal, taught.views[0].standard)
    tops = component_points(nominal.board, camera, T)
    assert len(tops) > 10
    bare = replace(nominal.board, components=())
    (point,) = component_points(bare, camera, T)
    assert point[2] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(T.act(point)[:2], 0, atol=1e-12)
    assert T.act(point)[2] > 0
