"""Which pixels of a part are asked."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from aoicell.inspection.templates import _telling

slopes = arrays(np.float32, st.integers(1, 400), elements=st.floats(0, 200, width=32))


@given(slopes, st.integers(1, 500))
def test_so_many_are_kept_each_once(steep: np.ndarray, most: int) -> None:
    keep = _telling(steep, most)
    assert len(keep) <= most
    assert len(keep) >= min(len(steep), most) * 0.5
    assert (np.diff(keep) > 0).all()
    assert keep[0] >= 0
    assert keep[-1] < len(steep)
    if len(steep) <= most:
        assert len(keep) == len(steep)


def test_edges_are_kept_and_the_rest_is_thinned_out_evenly() -> None:
    steep = np.zeros(10_000, np.float32)
    edge = slice(4000, 4200)
    steep[edge] = 50.0
    keep = _telling(steep, 1000)
    asked = np.zeros(len(steep), bool)
    asked[keep] = True
    assert asked[edge].mean() > 0.95
    assert 0.04 < asked[:2000].mean() < 0.12
    assert abs(asked[:2000].mean() - asked[-2000:].mean()) < 0.01
