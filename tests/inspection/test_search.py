"""Where a part that is not in its place may lie: the true place is among the few that are asked."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.inspection.inspect import STANDARD
from aoicell.inspection.search import Search
from aoicell.inspection.standard import standard_of
from inspection.flat_boards import SIZE_MM, Flat, Pose, flat_reference, painted, photograph

MM = 1e-3


@pytest.mark.parametrize("pose", [(1.9 * MM, -0.7 * MM, 0.0), (-3.1 * MM, 2.3 * MM, 0.0),
                                  (0.1 * MM, 0.0, 1.2), (0.0, -0.2 * MM, -2.5)])  # fmt: skip
def test_the_true_place_comes_first(flat: Flat, pose: Pose) -> None:
    standard = standard_of(flat.reference, flat.board, STANDARD)
    picture = photograph(painted(flat.board, {"U12": pose}), seed=2).astype(np.float32)
    first = standard.tools["U12"].search.places(picture, 5e-3)[0]
    assert first.shift == pytest.approx(pose[:2], abs=0.4 * MM)
    assert first.rotation == pytest.approx(pose[2], abs=0.1)


def test_a_small_part_is_looked_for_in_finer_steps() -> None:
    """Of one of ten pixels a side, a pixel aside in both directions is as good as anywhere."""
    design = board(
        component("R1", "resistor", -20, 10, (2.4, 2.0, 0.1)),
        *[component(f"U{n}", "chip", 30 * n - 60, -20, (9, 6, 0.1)) for n in range(5)],
        size_mm=SIZE_MM,
    )
    standard = standard_of(flat_reference(painted(design)), design, STANDARD)
    template = standard.tools["R1"].template
    assert template.inside.sum() < STANDARD.search.small
    px = 1 / template.px_per_m
    pose = (11 * px, -7 * px, 0.0)
    picture = photograph(painted(design, {"R1": pose}), seed=2).astype(np.float32)
    nearest = []
    for config in (STANDARD.search, replace(STANDARD.search, small=0)):
        places = Search(template, standard.mean, config).places(picture, 5e-3)
        nearest.append(np.hypot(*np.subtract(places[0].shift, pose[:2])) / px)
    assert nearest[0] < 0.8
    assert nearest[1] > 1.2


def test_nothing_nearer_than_asked_for_is_named(flat: Flat) -> None:
    standard = standard_of(flat.reference, flat.board, STANDARD)
    places = standard.tools["U12"].search.places(standard.mean, 5e-3, least=2e-3)
    assert places
    assert min(np.hypot(*place.shift) for place in places) >= 2e-3
    assert standard.tools["U12"].search.places(standard.mean, 1e-3, least=2e-3) == []
