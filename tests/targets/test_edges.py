"""Edges and bars at known places are found there, whatever the blur or the polarity."""

import cv2
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from aoicell.observation import Image
from aoicell.targets.edges import Strips, bar_offsets, fit_lines, intersections, step_offsets

U = np.linspace(-8, 8, 65)
ALONG = np.array([[0.0, 1.0]])  # lines run down the picture,
ACROSS = np.array([[1.0, 0.0]])  # positions count to the right


def covered(edge: float, size: int = 64) -> Image:
    """A picture that is white to the right of u = edge, by area."""
    share = np.clip(np.arange(size) + 0.5 - edge, 0, 1)
    return np.tile(np.round(40 + 160 * share), (size, 1)).astype(np.uint8)


@given(st.floats(-1, 1))
def test_strips_follow_their_vectors(shift: float) -> None:
    grey = np.add.outer(2.0 * np.arange(64), np.arange(64)).astype(np.uint8)  # 2 v + u
    strips = Strips(
        np.array([[30.0 + shift, 20.0]]), ALONG, ACROSS, np.array([0.0, 3.0]), np.array([0.0, 5.0])
    )
    expected = 70 + shift + np.array([[0, 5], [6, 11]])
    np.testing.assert_allclose(strips.sample(grey)[0], expected, atol=0.04)  # 1/32 px in remap


@given(st.floats(28, 36), st.sampled_from([0.0, 0.8, 1.5]), st.booleans())
def test_a_step_is_found_where_it_is(edge: float, blur: float, inverted: bool) -> None:
    assume(abs(edge - 32) + 2.5 * blur <= 6)  # both ends of the profile have to be flat
    grey = covered(edge)
    if blur:
        grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), blur), dtype=np.uint8)
    if inverted:
        grey = np.asarray(255 - grey, dtype=np.uint8)
    strips = Strips(np.array([[32.0, 32.0]]), ALONG, ACROSS, np.linspace(-5, 5, 11), U)
    offsets = step_offsets(strips.sample(grey), U)
    assert np.abs(offsets - (edge - 32)).max() < 0.03


@given(st.floats(30, 34), st.floats(2.5, 5))
def test_a_bar_is_found_at_its_middle(middle: float, width: float) -> None:
    left, right = covered(middle - width / 2), covered(middle + width / 2)
    grey = (200 - left.astype(int) + right).astype(np.uint8)
    strips = Strips(np.array([[32.0, 32.0]]), ALONG, ACROSS, np.linspace(-5, 5, 11), U)
    offsets = bar_offsets(strips.sample(grey), U)
    # square with the raster, a pixel hides where in it each of the two edges runs
    assert np.abs(offsets - (middle - 32)).max() < 0.25 / width + 0.01


def test_a_bar_askew_to_the_raster_is_found_far_better() -> None:
    v, u = np.indices((64 * 8, 64 * 8)) / 8 + 0.5 / 8 - 0.5  # eight samples a pixel each way
    normal = np.array([np.cos(0.12), np.sin(0.12)])
    for place in np.linspace(-0.5, 0.5, 7):
        across = (u - 32) * normal[0] + (v - 32) * normal[1] - place
        fine = np.where(np.abs(across) < 1.7, 40.0, 200.0)
        grey = np.rint(fine.reshape(64, 8, 64, 8).mean(axis=(1, 3))).astype(np.uint8)
        along = np.array([[-normal[1], normal[0]]])
        strips = Strips(np.array([[32.0, 32.0]]), along, normal[None], np.linspace(-18, 18, 73), U)
        (a,), (b,) = fit_lines(strips.t, bar_offsets(strips.sample(grey), U))
        assert a == pytest.approx(place, abs=0.01)
        assert b == pytest.approx(0, abs=1e-3)


def test_a_sloping_background_does_not_move_a_bar() -> None:
    profile = 150 + 3 * U - 80 * (np.abs(U - 0.5) < 2)
    flat = 150 - 80 * (np.abs(U - 0.5) < 2)
    found = bar_offsets(np.stack([profile, flat]), U)
    assert found[0] == pytest.approx(found[1], abs=0.01)


def test_no_contrast_gives_no_position() -> None:
    flat = np.full((1, 3, 65), 128.0)
    assert np.isnan(step_offsets(flat, U)).all()
    assert np.isnan(bar_offsets(flat, U)).all()


def test_lines_are_fitted_each_on_its_own() -> None:
    t = np.linspace(-1, 3, 9)
    a, b = fit_lines(t, np.stack([2 + 0.5 * t, -1 - 0.1 * t]))
    np.testing.assert_allclose(a, [2, -1])
    np.testing.assert_allclose(b, [0.5, -0.1])


def test_lines_meet_where_both_are_fulfilled() -> None:
    a1, b1, a2, b2 = 0.3, 0.1, -0.2, 0.05
    x, y = np.array([[10.0, 1.0]]), np.array([[-1.0, 8.0]])
    (met,) = intersections(
        np.array([[100.0, 50.0]]), x, y, (np.array([a1]), np.array([b1])),
        (np.array([a2]), np.array([b2])),
    )  # fmt: skip
    u, v = np.linalg.solve(np.column_stack([x[0], y[0]]), met - [100, 50])
    assert v == pytest.approx(a1 + b1 * u)
    assert u == pytest.approx(a2 + b2 * v)
