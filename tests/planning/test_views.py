"""Few views show everything, and what cannot be shown or reached is said."""

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.errors import InputError
from aoicell.nominal import View
from aoicell.planning.coverage import Inspector, Limits, Scene
from aoicell.planning.heights import heights_of
from aoicell.planning.targets import Hidden, features_of
from aoicell.planning.view_search import Reachable, distances
from aoicell.planning.views import ViewPlan, area_bound, plan_views

CAMERA = Camera.pinhole(2667, 1600, 1200)


def planned(
    design: BoardDesign, reachable: Reachable = lambda view: True
) -> tuple[ViewPlan, Inspector]:
    field = heights_of(design)
    features, _ = features_of(design, field)
    inspector = Inspector(Scene(features, field, CAMERA, np.zeros((0, 3)), Limits()))
    return plan_views(inspector, design, reachable), inspector


def seen(plan: ViewPlan, inspector: Inspector) -> np.ndarray:
    return np.any([inspector.seen(view) for view in plan.views], axis=0)


@pytest.mark.parametrize(
    ("size_mm", "px_per_mm", "pictures"),
    [((320, 240), 5, 1), ((321, 240), 5, 2), ((420, 330), 5, 2), ((420, 330), 10, 8)],
)
def test_the_area_bound(size_mm: tuple[float, float], px_per_mm: float, pictures: int) -> None:
    """A picture of 1600 x 1200 px covers 320 x 240 mm at 5 px/mm."""
    assert area_bound(board(size_mm=size_mm), CAMERA, px_per_mm) == pictures


def test_a_small_board_takes_one_picture() -> None:
    plan, inspector = planned(
        board(
            component("U1", "chip", -30, 20, (12, 12, 2)),
            component("R1", "resistor", 40, -30, (1.6, 0.8, 0.5)),
        )
    )
    assert len(plan.views) == plan.bound == 1
    assert seen(plan, inspector).all()
    assert plan.uncovered == plan.hidden == ()


def test_parts_in_all_corners_take_several() -> None:
    design = board(
        *(
            component(f"R{k}", "resistor", x, y, (1.6, 0.8, 0.5))
            for k, (x, y) in enumerate((x, y) for x in (-200, 200) for y in (-150, 150))
        ),
        size_mm=(420, 330),
    )
    plan, inspector = planned(design)
    assert seen(plan, inspector).all()
    assert 2 <= len(plan.views) <= 4


def test_what_lies_in_a_shaft_is_hidden_with_a_reason() -> None:
    """Only a camera within 2 mm of the shaft's axis would see into it."""
    walls = [
        component(f"J{x}{y}", "connector", 2.25 * x, 2.25 * y, (3 + 2 * abs(y), 3 + 2 * abs(x), 60))
        for x, y in ((-1, 0), (1, 0), (0, -1), (0, 1))
    ]
    plan, inspector = planned(board(component("LBL", "label", 0, 0, (1, 1, 0.2)), *walls))
    assert plan.hidden == (Hidden("LBL", "print", "no view of the search shows it"),)
    assert plan.uncovered == ()
    assert seen(plan, inspector)[1:].all()
    assert inspector.seen(View("", 0.48))[0]


def test_views_that_are_not_reached_are_not_planned() -> None:
    def left_only(view: View) -> bool:
        return view.aim[0] <= 0

    design = board(component("U1", "chip", 10, 0, (12, 12, 2)))
    plan, inspector = planned(design, left_only)
    assert seen(plan, inspector).all()
    assert all(view.aim[0] <= 0 for view in plan.views)


def test_a_board_beyond_reach_is_refused_by_name() -> None:
    design = board(component("U1", "chip", 30, 0, (12, 12, 2)))
    with pytest.raises(InputError, match=r"small, 100 x 80 mm, is larger .*reach.*U1"):
        planned(design, lambda view: False)


def test_a_resolution_that_nothing_gives_is_refused() -> None:
    design = board(component("U1", "chip", 30, 0, (12, 12, 2)))
    field = heights_of(design)
    features, _ = features_of(design, field)
    limits = Limits(px_per_mm=40)
    inspector = Inspector(Scene(features, field, CAMERA, np.zeros((0, 3)), limits))
    with pytest.raises(InputError, match=r"40 px/mm take .* 67 mm at most.*5\.8 px/mm or less"):
        plan_views(inspector, design, lambda view: True)


def test_the_distances_are_where_blur_and_resolution_end() -> None:
    limits = Limits()
    near, far = distances(CAMERA, limits)
    assert 2667 * limits.aperture * (1 / near - 1 / limits.focus) == pytest.approx(limits.blur_px)
    assert 2667 / (far * 1e3) == pytest.approx(limits.px_per_mm)


def test_the_same_board_gives_the_same_views() -> None:
    design = board(component("U1", "chip", 30, 0, (12, 12, 2)))
    assert planned(design)[0] == planned(design)[0]
