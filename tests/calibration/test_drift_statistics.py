"""The tails of the drift check's tests, against closed forms."""

import numpy as np
import pytest

from aoicell.calibration.drift_statistics import tail


def test_chi_square_of_two_is_exponential() -> None:
    assert tail(3.0, 2, np.inf) == pytest.approx(np.exp(-1.5), rel=1e-12)


@pytest.mark.parametrize("noise_freedoms", [1.0, 7.5, 40.0])
def test_f_of_two_is_a_power(noise_freedoms: float) -> None:
    expected = (1 + 3.0 / noise_freedoms) ** (-noise_freedoms / 2)
    assert tail(3.0, 2, noise_freedoms) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("noise_freedoms", [5.0, np.inf])
def test_nothing_left_is_no_evidence(noise_freedoms: float) -> None:
    assert tail(0.0, 3, noise_freedoms) == 1
    assert tail(-1e-17, 3, noise_freedoms) == 1  # as rounding may leave it
    assert tail(1.0, 0, noise_freedoms) == 1
