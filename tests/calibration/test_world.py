"""The two-board set-up: where the table's board is, and how chessboard 1 sits on the flange."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aoicell.calibration.poses import SETUP_MOTIONS
from aoicell.calibration.world import TripodView, WorldSetup, set_up_world
from aoicell.errors import Implausible
from aoicell.nominal import Nominal
from aoicell.targets.chessboard import half_turn
from aoicell.transforms import SE3, distance_deg, distance_mm, from_rvec, translation

EXACT = 1e-4  # mm and deg

# What differs from the design: 1 mm and 0.5 deg of bracket, a board and a tripod put down by hand.
BRACKET = from_rvec(np.radians([0.3, -0.2, 0.35]), [0.6e-3, -0.5e-3, 0.6e-3])
BOARD = from_rvec([0, 0, np.radians(1.5)], [0.006, -0.004, 0])
TRIPOD = from_rvec(np.radians([1, -1, 0.5]), [0.02, -0.03, 0.01])


def tripod_views(nominal: Nominal, flips: list[tuple[bool, bool]]) -> list[TripodView]:
    camera, T_base_tripod = nominal.cameras["tripod"], nominal.T_base_tripod * TRIPOD
    views = []
    for dT, (flip_arm, flip_table) in zip(SETUP_MOTIONS, flips, strict=False):
        T_base_flange = nominal.T_base_flange_setup * dT
        T_base_arm = T_base_flange * nominal.T_flange_armtarget * BRACKET
        T_base_table = nominal.T_base_tabletarget * BOARD
        uv_arm = camera.project(nominal.armtarget.corners, T_base_tripod.actInv(T_base_arm))
        uv_table = camera.project(nominal.tabletarget.corners, T_base_tripod.actInv(T_base_table))
        views.append(
            TripodView(
                half_turn(uv_arm) if flip_arm else uv_arm,
                half_turn(uv_table) if flip_table else uv_table,
                T_base_flange,
            )
        )
    return views


def set_up(
    nominal: Nominal, views: list[TripodView], T_base_tabletarget: SE3 | None = None
) -> WorldSetup:
    return set_up_world(
        views,
        nominal.cameras["tripod"],
        nominal.armtarget,
        nominal.tabletarget,
        nominal.T_flange_armtarget,
        T_base_tabletarget or nominal.T_base_tabletarget,
    )


def assert_close(found: SE3, true: SE3) -> None:
    assert distance_mm(found, true) < EXACT
    assert distance_deg(found, true) < EXACT


@settings(max_examples=8)
@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=5, max_size=10))
def test_from_five_pictures_on_the_bracket_is_measured(
    nominal: Nominal, flips: list[tuple[bool, bool]]
) -> None:
    result = set_up(nominal, tripod_views(nominal, flips))
    assert_close(result.T_flange_armtarget, nominal.T_flange_armtarget * BRACKET)
    assert_close(result.T_base_tabletarget, nominal.T_base_tabletarget * BOARD)
    assert result.scatter_mm < EXACT
    assert result.views == len(flips)


@pytest.mark.parametrize("flips", [[(a, b)] for a in (False, True) for b in (False, True)])
def test_one_picture_takes_the_bracket_as_designed(
    nominal: Nominal, flips: list[tuple[bool, bool]]
) -> None:
    result = set_up(nominal, tripod_views(nominal, flips))
    assert result.T_flange_armtarget == nominal.T_flange_armtarget
    # the bracket's error is carried to the board through the flange, exactly
    T_base_arm = nominal.T_base_flange_setup * nominal.T_flange_armtarget
    true = nominal.T_base_tabletarget * BOARD
    assert_close(
        result.T_base_tabletarget, T_base_arm * BRACKET.inverse() * T_base_arm.actInv(true)
    )
    assert distance_mm(result.T_base_tabletarget, true) > 1
    assert result.scatter_mm == pytest.approx(0, abs=1e-9)


def test_four_pictures_are_not_enough_for_the_bracket(nominal: Nominal) -> None:
    result = set_up(nominal, tripod_views(nominal, [(False, True)] * 4))
    assert result.T_flange_armtarget == nominal.T_flange_armtarget
    assert result.scatter_mm > 0.05  # and now the pictures disagree
    assert result.views == 4


@pytest.mark.parametrize("count", [1, 10])
def test_boards_taken_for_each_other_are_refused(nominal: Nominal, count: int) -> None:
    views = [
        TripodView(view.uv_tabletarget, view.uv_armtarget, view.T_base_flange)
        for view in tripod_views(nominal, [(False, False)] * count)
    ]
    with pytest.raises(Implausible, match=r"world set-up: chessboard 2 lies \d+ mm from"):
        set_up(nominal, views)


def test_a_board_far_from_its_designed_place_is_refused(nominal: Nominal) -> None:
    views = tripod_views(nominal, [(False, False)])
    with pytest.raises(Implausible, match="which board is which"):
        set_up(nominal, views, nominal.T_base_tabletarget * translation(0.15))
