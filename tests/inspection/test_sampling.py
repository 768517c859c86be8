"""Grey values between the pixels: read where they are asked for."""

import cv2
import numpy as np
import pytest

from aoicell.inspection.sampling import sampled

FRACTIONS = np.linspace(0, 1, 65, dtype=np.float32)


def ramp() -> np.ndarray:
    """Of one grey value a column, and three a row."""
    v, u = np.mgrid[:40, :60].astype(np.float32)
    return np.asarray(u + 3 * v, np.float32)


def test_a_ramp_is_read_where_it_is_asked_for() -> None:
    """To half of the 1/32 px that OpenCV rounds to, along columns and rows; its kernel is not."""
    columns, rows = 20 + FRACTIONS, np.full_like(FRACTIONS, 11)
    along = sampled(ramp(), columns, rows) - (columns + 3 * rows)
    down = sampled(ramp(), rows, columns) - (rows + 3 * columns)
    plain = cv2.remap(ramp(), columns[:, None], rows[:, None], cv2.INTER_CUBIC)[:, 0]
    assert np.abs(along).max() < 0.02
    assert np.abs(down).max() < 3 * 0.02
    assert np.abs(plain - (columns + 3 * rows)).max() > 0.04


@pytest.mark.parametrize("step", [0.05, 0.15, 0.25])
def test_small_motions_are_as_large_as_they_are(step: float) -> None:
    """Of a pattern of nine pixels' period: no larger by a tenth."""
    u = np.tile(np.arange(60, dtype=np.float32), (40, 1))
    wave = np.asarray(100 * np.sin(2 * np.pi * u / 9), np.float32)
    columns = np.linspace(10, 50, 41, dtype=np.float32)
    rows = np.full_like(columns, 20)
    there, here = (sampled(wave, columns + x, rows) for x in (np.float32(step), np.float32(0)))
    slopes = 100 * 2 * np.pi / 9 * np.cos(2 * np.pi * columns / 9)
    moved = float(slopes @ (there - here) / (slopes @ slopes))
    assert moved == pytest.approx(step, rel=0.1, abs=1 / 64)


def test_whole_pixels_are_read_as_they_are_in_any_shape() -> None:
    plane = np.random.default_rng(0).uniform(0, 255, (40, 60)).astype(np.float32)
    rows, columns = np.mgrid[3:30, 5:50].astype(np.float32)
    assert sampled(plane, columns, rows) == pytest.approx(plane[3:30, 5:50], abs=1e-4)
    assert sampled(plane, columns[0], rows[0]).shape == (45,)


def test_more_places_than_are_taken_at_a_time() -> None:
    """The picture is put together of all strips."""
    plane = np.random.default_rng(1).uniform(0, 255, (300, 400)).astype(np.float32)
    rows, columns = np.mgrid[:300, :400].astype(np.float32) + np.float32(0.3)
    inner = (slice(2, -2), slice(2, -2))
    by_line = np.stack([sampled(plane, c, r) for c, r in zip(columns, rows, strict=True)])
    assert np.array_equal(sampled(plane, columns, rows)[inner], by_line[inner])


def test_beyond_the_edge_nothing_is_known() -> None:
    places = np.array([[-9.0, 30.0, 99.0]], np.float32)
    seen = sampled(ramp(), places, np.full_like(places, 20), beyond=np.nan)
    assert np.isnan(seen[0, [0, 2]]).all()
    assert seen[0, 1] == pytest.approx(90)
    assert sampled(ramp(), places, np.full_like(places, 20))[0, 0] == 0
