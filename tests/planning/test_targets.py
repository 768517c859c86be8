"""What must be seen of each kind of component."""

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.board import KINDS
from aoicell.planning.heights import heights_of
from aoicell.planning.targets import PATCHES, TILE, Feature, Hidden, features_of


def planned(*components: object) -> tuple[dict[tuple[str, str], Feature], list[Hidden]]:
    design = board(*components)  # type: ignore[arg-type]
    features, hidden = features_of(design, heights_of(design))
    return {(f.target, f.what): f for f in features}, hidden


def test_every_kind_has_its_patches() -> None:
    assert set(PATCHES) == set(KINDS)


@pytest.mark.parametrize(("turn", "quarter"), [(0, (-1, -1)), (90, (1, -1)), (180, (1, 1))])
def test_pin_1_turns_with_the_chip(turn: float, quarter: tuple[int, int]) -> None:
    features, _ = planned(component("U1", "chip", 10, -5, (12, 12, 2), rotation_deg=turn))
    pin = features["U1", "pin 1"].points
    np.testing.assert_array_equal(np.sign(pin.mean(axis=0)[:2] - [0.010, -0.005]), quarter)
    np.testing.assert_allclose(pin[:, 2], 0.002)


def test_a_can_shows_its_polarity_a_ceramic_block_its_caps() -> None:
    features, _ = planned(
        component("C1", "capacitor", 0, 0, (6.3, 6.3, 7.7)),
        component("C2", "capacitor", 20, 0, (2, 1.25, 1.2)),
    )
    assert {what for id, what in features if id == "C1"} == {"top", "polarity"}
    assert {what for id, what in features if id == "C2"} == {"top", "left cap", "right cap"}


def test_what_lies_under_another_part_is_named() -> None:
    features, hidden = planned(
        component("U1", "socket", 0, 0, (20, 20, 3)),
        component("HS1", "heatsink", 0, 0, (24, 24, 10), z_mm=3, on="U1"),
    )
    assert hidden == [Hidden("U1", "top", "it lies under HS1")]
    assert [id for id, _ in features] == ["HS1"]


def test_what_lies_under_a_label_is_left_out() -> None:
    features, hidden = planned(
        component("U1", "chip", 0, 0, (10, 10, 2)),
        component("LBL1", "label", 0, 0, (10, 5, 0.2), z_mm=2, on="U1"),
    )
    assert hidden == []
    assert (np.abs(features["U1", "top"].points[:, 1]) > 0.0025).all()


def test_a_long_part_is_shown_in_pieces() -> None:
    features, _ = planned(component("J1", "connector", 0, 0, (TILE * 2e3 * 0.9, 5, 10)))
    assert {what for _, what in features} == {"top 1/2", "top 2/2"}
    left = features["J1", "top 1/2"].corners
    assert left[:, 0].max() == pytest.approx(0.0)
    assert set(left[:, 2]) == {0.0, 0.010}
