"""What a view shows, against projections and shadows worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.nominal import View
from aoicell.planning.coverage import Inspector, Limits, Scene, Sight
from aoicell.planning.heights import heights_of
from aoicell.planning.targets import features_of
from aoicell.transforms import apply

CAMERA = Camera.pinhole(2667, 1600, 1200)
CHIP = component("U1", "chip", 0, 0, (8, 8, 2))


def inspector(design: BoardDesign, lamps: object = None, limits: Limits | None = None) -> Inspector:
    field = heights_of(design)
    features, _ = features_of(design, field)
    places = np.zeros((0, 3)) if lamps is None else np.array(lamps, dtype=float)
    return Inspector(Scene(features, field, CAMERA, places, limits or Limits()))


def sight(view: View, *components: object, lamps: object = None) -> Sight:
    return inspector(board(*components), lamps).sights(view)[0]  # type: ignore[arg-type]


def test_resolution_straight_from_above() -> None:
    """f / Z at the part's underside, the farther of its ends."""
    seen = sight(View("", 0.5), CHIP)
    assert seen.px_per_mm == pytest.approx(2667 / 500, rel=1e-6)
    assert seen.share == 1.0


def test_resolution_is_that_of_the_worst_direction() -> None:
    """Against differences of projected points on the board, in all directions."""
    view = View("", 0.45, tilt=(0.3, -0.2), roll=0.4, aim=(0.03, -0.02, 0.0))
    seen = sight(view, component("C1", "capacitor", 0, 0, (0.02, 0.02, 7)))
    T = view.T_target_camera.inverse()
    angles = np.linspace(0, np.pi, 721)
    step = 1e-6 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    px = CAMERA.project(apply(T, step)) - CAMERA.project(apply(T, np.zeros((1, 3))))
    assert seen.px_per_mm == pytest.approx(np.linalg.norm(px, axis=1).min() / 1e-3, rel=1e-3)


def test_margin_is_to_the_nearest_edge() -> None:
    """The chip's outer top corner is 54 mm right of the axis and 498 mm away."""
    seen = sight(View("", 0.5, aim=(-0.05, 0, 0)), CHIP)
    assert seen.margin_px == pytest.approx(799.5 - 54 * 2667 / 498, abs=0.01)


def test_what_is_out_of_the_picture_or_behind_it_is_not_seen() -> None:
    aside, behind = View("", 0.5, aim=(0.5, 0, 0)), View("", 0.5, aim=(0, 0, -0.6))
    for view in (aside, behind):
        assert sight(view, CHIP).margin_px < 0
        assert not inspector(board(CHIP)).seen(view).any()


def test_angle_is_off_the_normal() -> None:
    seen = sight(View("", 0.5, tilt=(np.radians(20), 0.0)), CHIP)
    assert seen.angle_deg == pytest.approx(20, abs=0.6)


def test_blur_of_a_lens_focused_behind_the_board() -> None:
    seen = sight(View("", 0.5), CHIP)
    assert seen.blur_px == pytest.approx(2667 * 1.5e-3 * (1 / 0.5 - 1 / 0.7), rel=0.02)


def test_a_taller_neighbour_hides_on_its_far_side_only() -> None:
    wall = component("J1", "connector", 8, 0, (4, 40, 25))
    left, right = (View("", 0.5, aim=(x, 0, 0)) for x in (-0.1, 0.1))
    small = component("R1", "resistor", 4.5, 0, (1.6, 0.8, 0.5))
    assert sight(left, small, wall).share == 1.0
    assert sight(right, small, wall).share == 0.0
    assert inspector(board(small, wall)).seen(left)[0]
    assert not inspector(board(small, wall)).seen(right)[0]


def test_a_lamp_mirrored_into_the_lens_is_glare() -> None:
    """The mirror image of a lamp at (0.4, 0, 1) m is seen in the board at (0.4 / 3, 0) from 0.5 m
    above the origin: there and nowhere near it.
    """
    there = component("U1", "chip", 400 / 3, 0, (6, 6, 0.1))
    beside = component("U2", "chip", 400 / 3 - 100, 0, (6, 6, 0.1))
    design = board(there, beside, size_mm=(400, 100))
    view = View("", 0.5)
    seen = inspector(design, lamps=[[0.4, 0, 1.0]]).sights(view)
    by_target = dict(zip(["U1", "U1 pin", "U2", "U2 pin"], seen, strict=True))
    assert by_target["U1"].share == 0.0
    assert by_target["U2"].share == 1.0
    assert inspector(design).sights(view)[0].share == 1.0


@pytest.mark.parametrize(
    "limits",
    [
        Limits(px_per_mm=5.5), Limits(angle_deg=0.1), Limits(blur_px=2.0), Limits(margin_px=580),
    ],
)  # fmt: skip
def test_each_limit_counts(limits: Limits) -> None:
    view = View("", 0.5)
    assert inspector(board(CHIP)).seen(view).all()
    assert not inspector(board(CHIP), limits=limits).seen(view).any()


def test_values_agree_with_what_is_seen() -> None:
    design = board(CHIP, component("C1", "capacitor", 45, 30, (6.3, 6.3, 7.7)))
    asked = inspector(design, limits=replace(Limits(), margin_px=420))
    view = View("", 0.5, aim=(-0.03, 0, 0))
    np.testing.assert_array_equal(asked.values(view) > 0, asked.seen(view))
    assert set(asked.seen(view)) == {True, False}
