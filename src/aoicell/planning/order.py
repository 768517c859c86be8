"""The order of visits: a round trip over all stops that takes little time.

Up to ten stops the shortest there is (dynamic programming; Held and Karp 1962), above that one
that no exchange of two ways improves (2-opt; Croes 1958).
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from aoicell.transforms import Array

EXACT = 10  # stops up to which the best of all orders is found

Order = tuple[int, ...]


def best_order(at_least: Array, price: Callable[[int, int], float]) -> Order:
    """The order of the stops 1 to N of a quick round trip from and to 0, never longer than 1..N.

    `at_least` (N + 1, N + 1) are symmetric lower bounds of the cost of going from one to another;
    `price` tells the true cost of one way (the same for both directions; inf: there is none). A
    way is priced only once the best order by what is known so far takes it, which changes nothing:
    when all ways of an order are priced, no other can be better.
    """
    costs, count = np.array(at_least, dtype=float), len(at_least) - 1
    given: Order = tuple(range(1, count + 1))
    priced: set[frozenset[int]] = set()

    def price_all(order: Order) -> bool:
        """Whether there was any way of the order left to price."""
        ways = [way for way in pairwise((0, *order, 0)) if frozenset(way) not in priced]
        for i, j in ways:
            costs[i, j] = costs[j, i] = price(i, j)
            priced.add(frozenset((i, j)))
        return bool(ways)

    price_all(given)  # which the result must not be worse than
    while True:
        order = tuple(_exact(costs) if count <= EXACT else _two_opt(costs, given))
        if not price_all(order):
            return order


def length(costs: Array, order: Sequence[int]) -> float:
    """Of the round trip from and to 0."""
    return float(sum(costs[way] for way in pairwise((0, *order, 0))))


def _exact(costs: Array) -> list[int]:
    """The shortest of all round trips. `best[visited, last]`: the shortest way over the stops of
    the bit set `visited` that ends at stop `last` (stops count from 0 here).
    """
    count = len(costs) - 1
    if count == 0:
        return []
    between, best = costs[1:, 1:], np.full((1 << count, count), np.inf)
    before = np.zeros(best.shape, dtype=int)
    best[1 << np.arange(count), np.arange(count)] = costs[0, 1:]
    for visited in range(1, 1 << count):
        for last in range(count):
            rest = visited & ~(1 << last)
            if rest != visited and rest:
                ways = best[rest] + between[:, last]
                before[visited, last] = ways.argmin()
                best[visited, last] = ways.min()
    visited = (1 << count) - 1
    last = int((best[visited] + costs[1:, 0]).argmin())
    order = [last]
    while len(order) < count:
        visited, last = visited & ~(1 << last), int(before[visited, last])
        order.append(last)
    return [stop + 1 for stop in order]


def _two_opt(costs: Array, given: Sequence[int]) -> list[int]:
    """The better of two starts, the given order and always the nearest next, each improved."""
    starts = [list(given), _nearest(costs)]
    return min((_improved(costs, start) for start in starts), key=lambda o: length(costs, o))


def _nearest(costs: Array) -> list[int]:
    order, left = [0], set(range(1, len(costs)))
    while left:
        nearest = min(sorted(left), key=lambda stop: costs[order[-1], stop])
        order.append(nearest)
        left.remove(nearest)
    return order[1:]


def _improved(costs: Array, order: list[int]) -> list[int]:
    """Turn stretches of the round trip round until no turn makes it shorter."""
    shortest, found = length(costs, order), True
    while found:
        found = False
        for i in range(len(order) - 1):
            for j in range(i + 2, len(order) + 1):
                turned = order[:i] + order[i:j][::-1] + order[j:]
                turned_length = length(costs, turned)
                if turned_length < shortest - 1e-9:
                    order, shortest, found = turned, turned_length, True
    return order
