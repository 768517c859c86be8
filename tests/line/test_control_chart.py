"""Charts against published limits, and against what happens to simulated readings."""

import numpy as np
import pytest

from aoicell.line.control_chart import Chart, average_run_length, innovations, studentised
from aoicell.transforms import Array


@pytest.mark.parametrize(
    ("size", "weight", "limit", "run_length"),
    [  # Prabhu and Runger 1997; Lucas and Saccucci 1990 (its L, squared)
        (2, 0.1, 8.64, 200),
        (4, 0.1, 12.73, 200),
        (1, 0.1, 2.814**2, 500),
        (1, 0.25, 2.998**2, 500),
    ],
)
def test_the_run_length_is_that_of_published_tables(
    size: int, weight: float, limit: float, run_length: float
) -> None:
    assert average_run_length(size, weight, limit) == pytest.approx(run_length, rel=0.03)


@pytest.mark.parametrize("size", [1, 6])
def test_limits_belong_to_the_run_length_that_is_asked_for(size: int) -> None:
    chart = Chart(size, weight=0.2, run_length=740.0)
    assert average_run_length(size, 0.2, chart.limit) == pytest.approx(740, rel=1e-3)
    assert Chart(size, run_length=2000).limit > chart.limit > Chart(size, run_length=100).limit


def first_alarms(chart: Chart, runs: int, length: int, rng: np.random.Generator) -> Array:
    """After how many readings each run alarms; `length` where it does not."""
    found = []
    for _ in range(runs):
        values = chart.statistics(rng.standard_normal((length, chart.size)))
        over = np.flatnonzero(values > chart.limit)
        found.append(over[0] + 1 if len(over) else length)
    return np.array(found)


def test_simulated_false_alarms_come_as_seldom_as_stated(rng: np.random.Generator) -> None:
    alarms = first_alarms(Chart(6, run_length=50.0), 400, 400, rng)
    assert alarms.mean() == pytest.approx(50, abs=4 * alarms.std() / 20)


def test_innovations_do_not_know_the_mean_and_are_standard_normal(
    rng: np.random.Generator,
) -> None:
    A = rng.standard_normal((3, 3))
    readings = rng.standard_normal((4000, 3)) @ A.T
    values = innovations(readings, A @ A.T)
    assert values.shape == (3999, 3)
    np.testing.assert_allclose(np.cov(values.T), np.eye(3), atol=0.1)
    np.testing.assert_allclose(values, innovations(readings + [5, -3, 1], A @ A.T), atol=1e-6)
    # one after the other they have nothing in common
    lagged = (values[1:].T @ values[:-1]) / len(values)
    assert np.abs(lagged).max() < 0.07


def test_the_first_innovations_are_as_wide_as_the_later_ones(rng: np.random.Generator) -> None:
    runs = rng.standard_normal((2000, 4, 1))
    first = np.array([innovations(run, np.eye(1))[:, 0] for run in runs])
    np.testing.assert_allclose(first.std(axis=0), 1, atol=0.07)


def test_neither_mean_nor_spread_matters_to_studentised_values(rng: np.random.Generator) -> None:
    runs = rng.standard_normal((2000, 6))
    values = np.array([studentised(run)[:, 0] for run in runs])
    assert values.shape == (2000, 4)
    np.testing.assert_allclose(values.std(axis=0), 1, atol=0.07)
    assert (np.abs(values) > 3).mean() < 0.006  # 0.0027 of a normal one; of Student's t far more
    np.testing.assert_allclose(studentised(7 + 0.01 * runs[0]), studentised(runs[0]), atol=1e-6)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_drift_is_found_and_the_sooner_the_faster(sign: int, rng: np.random.Generator) -> None:
    chart, noise = Chart(2), rng.standard_normal((300, 2))
    after = []
    for slope in (0.02, 0.1, 0.5):
        readings = noise + sign * slope * np.arange(300)[:, None] * [1, 0]
        statistics = chart.statistics(innovations(readings, np.eye(2)))
        over = np.flatnonzero(statistics > chart.limit)
        after.append(over[0])
    assert after[0] > after[1] > after[2]
    assert after[0] < 150
    assert after[2] < 15


def test_readings_without_any_noise(rng: np.random.Generator) -> None:
    still = np.zeros(8)
    moved = np.r_[still, 1e-3]
    assert not studentised(still).any()
    assert studentised(moved)[-1, 0] > 5
