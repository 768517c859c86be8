"""Corners of a synthetic checker pattern are found where they are, and nowhere else."""

import cv2
import numpy as np
import pytest

from aoicell.observation import Image
from aoicell.targets.crossings import (
    EdgeWindow,
    checker_contrast,
    has_checkers,
    refine_crossings,
    settle_crossings,
)
from aoicell.transforms import Array

X, Y = np.array([[30.0, 4.0]]), np.array([[-5.0, 28.0]])


def corner(at: tuple[float, float], blur_px: float = 0.8) -> Image:
    """A saddle whose edges run along X and Y; dark between +x and +y and opposite of it."""
    v, u = np.mgrid[0 : 120 * 8, 0 : 120 * 8] / 8 + 0.0625 - 0.5
    du, dv = u - at[0], v - at[1]
    a = du * Y[0, 1] - dv * Y[0, 0]  # along x
    b = dv * X[0, 0] - du * X[0, 1]  # along y
    fine = np.where(a * b > 0, 40, 200).astype(np.uint8)
    small = cv2.resize(fine, (120, 120), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), blur_px), dtype=np.uint8)


@pytest.mark.parametrize("at", [(60.0, 60.0), (58.3, 61.7)])
@pytest.mark.parametrize("off", [(0.0, 0.0), (2.0, -1.5)])
def test_the_crossing_is_found(at: tuple[float, float], off: tuple[float, float]) -> None:
    start = np.array([at]) + off
    uv = settle_crossings(corner(at), start, X, Y, EdgeWindow())
    np.testing.assert_allclose(uv, [at], atol=0.01)


def test_a_window_no_wider_than_the_blur_settles_in_several_steps() -> None:
    at, window = (58.3, 61.7), EdgeWindow(low=0.06, high=0.06)
    grey, start = corner(at, 1.2), np.array([[59.5, 61.0]])
    once = refine_crossings(grey, start, X, Y, window)
    settled = settle_crossings(grey, start, X, Y, window)
    assert np.linalg.norm(once - at) > 0.1
    assert np.linalg.norm(settled - at) < 0.03


def test_where_nothing_is_there_is_no_crossing() -> None:
    blank = np.full((120, 120), 128, dtype=np.uint8)
    starts: Array = np.array([[60.0, 60.0]])
    assert np.isnan(settle_crossings(blank, starts, X, Y, EdgeWindow())).all()
    edge = blank.copy()
    edge[:, 60:] = 30  # one edge is no corner
    assert np.isnan(settle_crossings(edge, starts, X, Y, EdgeWindow())).all()


def test_a_lost_corner_leaves_the_others_alone() -> None:
    at = (58.3, 61.7)
    starts = np.array([[20.0, 20.0], at])
    uv = settle_crossings(corner(at), starts, np.tile(X, (2, 1)), np.tile(Y, (2, 1)), EdgeWindow())
    assert np.isnan(uv[0]).all()
    np.testing.assert_allclose(uv[1], at, atol=0.01)


def test_contrast_tells_which_quadrants_are_dark() -> None:
    grey, at = corner((60.0, 60.0)), np.array([[60.0, 60.0]])
    assert checker_contrast(grey, at, X, Y)[0] > 100
    assert checker_contrast(255 - grey, at, X, Y)[0] < -100
    assert checker_contrast(grey, at + X, X, Y)[0] == 0  # an edge


def test_the_majority_settles_the_colours() -> None:
    column, row = np.array([0, 1, 0, 1]), np.array([0, 0, 1, 1])
    alternating = np.array([50.0, -50, -50, 50])
    assert has_checkers(alternating, column, row).all()
    assert has_checkers(-alternating, column, row).all()
    assert has_checkers(np.array([50.0, 50, -50, 2]), column, row).tolist() == [
        True, False, True, False,
    ]  # fmt: skip
