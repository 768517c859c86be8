"""Blobs are put in order whatever the perspective, or not at all."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.targets.lattice import order
from aoicell.transforms import Array

PATTERN = np.array([(x, y) for y in range(5) for x in range(7)])


def seen(angle: float, slant: tuple[float, float], squeeze: float) -> Array:
    """The pattern in a picture, x right and y down."""
    c, s = np.cos(angle), np.sin(angle)
    xy = (PATTERN - PATTERN.mean(axis=0)) @ np.array([[c, s], [-s, c]]) * [1, squeeze]
    uv: Array = 30 * xy / (1 + xy @ slant)[:, None] + 300
    return uv


slants = st.tuples(st.floats(-0.03, 0.03), st.floats(-0.03, 0.03))


@given(st.floats(-3.2, 3.2), slants, st.floats(0.5, 1.0), st.randoms(use_true_random=False))
def test_both_readings_are_found(angle, slant, squeeze, random) -> None:  # type: ignore[no-untyped-def]
    uv = seen(angle, slant, squeeze)
    shuffle = list(range(len(uv)))
    random.shuffle(shuffle)
    ordered = order(uv[shuffle], PATTERN)
    readings = sorted(np.array(shuffle)[r].tolist() for r in ordered.readings)
    assert readings == [list(range(35)), list(range(34, -1, -1))]


def test_clutter_does_not_matter(rng: np.random.Generator) -> None:
    uv = seen(0.3, (0.01, 0.02), 0.8)
    clutter = rng.uniform(0, 150, (40, 2))
    ordered = order(np.concatenate([clutter, uv]), PATTERN)
    assert [list(range(40, 75))] == [r.tolist() for r in ordered.readings if r[0] == 40]


def test_a_missing_dot_is_not_made_up() -> None:
    uv = np.delete(seen(0.3, (0.01, 0.02), 0.8), 17, axis=0)
    ordered = order(uv, PATTERN)
    assert ordered.readings == []
    one_more = order(np.concatenate([uv, [[5.0, 5.0]]]), PATTERN)
    assert one_more.readings == []
    assert one_more.grown == 34


def test_another_layout_is_not_taken_for_it() -> None:
    other = np.array([(x, y) for y in range(6) for x in range(6)])
    assert order(seen(0.3, (0.01, 0.02), 0.8), other).readings == []


@pytest.mark.parametrize("count", [0, 1, 34])
def test_too_few_blobs(count: int) -> None:
    assert order(seen(0, (0, 0), 1)[:count], PATTERN).readings == []


def test_a_mirrored_pattern_is_not_read(rng: np.random.Generator) -> None:
    lame = np.array([(x, y) for y in range(4) for x in range(5) if (x, y) != (4, 0)])
    uv = 30.0 * lame + 100 + rng.normal(0, 0.5, lame.shape)
    assert [r.tolist() for r in order(uv, lame).readings] == [list(range(19))]
    assert order(uv * [-1, 1] + [500, 0], lame).readings == []
