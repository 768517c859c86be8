"""Prints cover each pixel as much as the ink does."""

import numpy as np
import pytest

from aoicell.targets.prints import Canvas


def test_cells_on_the_raster_are_black_and_white() -> None:
    canvas = Canvas((0.004, 0.002), 1000)
    canvas.cells(np.array([[1.0, 0.0], [0.0, 1.0]]), (-0.001, 0.0), (0.002, 0.002))
    np.testing.assert_array_equal(canvas.image(), [[0, 255, 255, 255], [255, 0, 255, 255]])


def test_a_cell_between_pixels_is_shared() -> None:
    canvas = Canvas((0.003, 0.001), 1000)
    canvas.cells(np.ones((1, 1)), (0.00025, 0.0), (0.001, 0.001))
    np.testing.assert_allclose(canvas.dark, [[0, 0.75, 0.25]], atol=1e-12)


def test_the_first_row_is_the_upper_one() -> None:
    canvas = Canvas((0.001, 0.004), 1000)
    canvas.cells(np.ones((1, 1)), (0.0, 0.0015), (0.001, 0.001))
    assert canvas.image()[:, 0].tolist() == [0, 255, 255, 255]


def test_a_disc_has_its_area_and_place() -> None:
    canvas = Canvas((0.1, 0.08), 4000)
    canvas.disc((0.02, 0.01), 0.03)
    x, y = ((edges[1:] + edges[:-1]) / 2 for edges in (canvas.x, canvas.y))
    assert canvas.dark.sum() / 4000**2 == pytest.approx(np.pi * 0.015**2, rel=1e-3)
    assert (canvas.dark * x).sum() / canvas.dark.sum() == pytest.approx(0.02, abs=1e-6)
    assert (canvas.dark.T * y).sum() / canvas.dark.sum() == pytest.approx(0.01, abs=1e-6)
