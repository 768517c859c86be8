"""The order of visits, against all orders there are."""

from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.planning.order import EXACT, best_order, length
from aoicell.transforms import Array


def tour_costs(seed: int, stops: int) -> Array:
    """Distances between points drawn in the unit square; the first is home."""
    points = np.random.default_rng(seed).uniform(size=(stops + 1, 2))
    return np.asarray(np.linalg.norm(points[:, None] - points[None], axis=2))


def shortest(costs: Array) -> float:
    stops = range(1, len(costs))
    return min(length(costs, order) for order in permutations(stops))


@given(seed=st.integers(0, 10_000), stops=st.integers(0, 6))
def test_few_stops_come_in_the_best_of_all_orders(seed: int, stops: int) -> None:
    costs = tour_costs(seed, stops)
    order = best_order(costs, lambda i, j: costs[i, j])
    assert sorted(order) == list(range(1, stops + 1))
    assert length(costs, order) == pytest.approx(shortest(costs))


@given(seed=st.integers(0, 10_000), share=st.floats(0, 1))
def test_it_is_best_by_the_true_cost_though_few_ways_are_priced(seed: int, share: float) -> None:
    rng, at_least = np.random.default_rng(seed), tour_costs(seed, 6)
    detours = np.triu(rng.uniform(0, 2, at_least.shape) * (rng.uniform(size=(7, 7)) < share), 1)
    costs = at_least + detours + detours.T
    asked = []

    def price(i: int, j: int) -> float:
        asked.append(frozenset((i, j)))
        return float(costs[i, j])

    order = best_order(at_least, price)
    assert length(costs, order) == pytest.approx(shortest(costs))
    assert len(asked) == len(set(asked)), "each way is priced once, for both directions"


def test_ways_that_no_good_order_takes_are_not_priced() -> None:
    costs, asked = tour_costs(3, EXACT), set()

    def price(i: int, j: int) -> float:
        asked.add(frozenset((i, j)))
        return float(costs[i, j])

    best_order(costs, price)
    assert len(asked) < (EXACT + 1) * EXACT / 2 / 2


@given(seed=st.integers(0, 10_000), stops=st.integers(2, 16))
def test_it_is_never_longer_than_the_given_order(seed: int, stops: int) -> None:
    rng, at_least = np.random.default_rng(seed), tour_costs(seed, stops)
    detours = np.triu(rng.exponential(0.3, at_least.shape), 1)
    costs = at_least + detours + detours.T
    order = best_order(at_least, lambda i, j: float(costs[i, j]))
    assert sorted(order) == list(range(1, stops + 1))
    assert length(costs, order) <= length(costs, range(1, stops + 1)) + 1e-9


def test_many_stops_on_a_circle_are_visited_round_it(rng: np.random.Generator) -> None:
    turns = rng.permutation(20) * 2 * np.pi / 20  # above what is solved exactly
    points = np.column_stack([np.cos(turns), np.sin(turns)])
    costs = np.linalg.norm(points[:, None] - points[None], axis=2)
    order = best_order(costs, lambda i, j: float(costs[i, j]))
    assert length(costs, order) == pytest.approx(20 * 2 * np.sin(np.pi / 20))


def test_where_there_is_no_way_another_order_is_taken() -> None:
    costs = tour_costs(1, 4)
    free = best_order(costs, lambda i, j: float(costs[i, j]))
    closed = frozenset(free[:2])
    order = best_order(costs, lambda i, j: np.inf if {i, j} == closed else float(costs[i, j]))
    assert closed not in [frozenset(way) for way in pairwise((0, *order, 0))]
