"""Ways between postures without contact: straight in the joints, else over postures in between.

Every way is proved on the design: between two postures that are checked no point comes further
than the clearance, so that at least half of it is left on all of the way.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse.csgraph import dijkstra

from aoicell.errors import Unreachable
from aoicell.planning.reach import Reach
from aoicell.robot.collision import Pair
from aoicell.robot.trajectories import plan
from aoicell.transforms import SE3, Array

RETREATS = (0.1, 0.25)  # how far above a posture the ways over it lead (m)


@dataclass(frozen=True)
class Path:
    """A way from rest to rest: postures qs (N, dof; rad) with both ends, and its duration (s).

    From each posture to the next the joints go in a straight line and come to rest.
    """

    qs: Array
    duration: float


class Paths:
    """Ways among what a `Reach` knows of."""

    def __init__(self, reach: Reach) -> None:
        self._reach, self._arm = reach, reach.nominal.arm
        self._up = reach.nominal.T_world_base.rotation.T @ [0, 0, 1]

    def duration(self, q_from: Array, q_to: Array) -> float:
        """Of the straight way (s), within the drives' limits; obstacles do not count."""
        return plan(self._arm, q_from, q_to).duration

    def contact(self, q_from: Array, q_to: Array) -> Pair | None:
        """Two bodies that come too close on the straight way; None when it is free."""
        cell, way = self._reach.cell, q_to - q_from
        count = int(np.ceil(cell.travel(way) / (self._reach.config.clearance_mm / 1e3)))
        touch = cell.first_touch(q_from + np.linspace(0, 1, count + 1)[:, None] * way)
        return None if touch is None else touch[1]

    def between(self, q_from: Array, q_to: Array, name: str = "path") -> Path:
        """The straight way if it is free, else the quickest over home or a retreat upwards.

        Raises Unreachable, naming what is in the straight way, when none of these is free.
        """
        blocked = self.contact(q_from, q_to)
        if blocked is None:
            return Path(np.array([q_from, q_to]), self.duration(q_from, q_to))
        detour = self._quickest(np.array([q_from, q_to, *self._vias(q_from, q_to)]))
        if detour is not None:
            return detour
        raise Unreachable(
            f"{name}: on the straight way {blocked[0]} would come closer than "
            f"{self._reach.config.clearance_mm:g} mm to {blocked[1]}, and no way over home or up "
            f"to {max(RETREATS) * 1e3:.0f} mm higher is free; move {blocked[1]} away or leave "
            "out the view"
        )

    def _vias(self, q_from: Array, q_to: Array) -> Iterator[Array]:
        yield self._reach.nominal.q_home
        for q in (q_from, q_to, (q_from + q_to) / 2):
            for height in RETREATS:
                raised = self._raised(q, height)
                if raised is not None:
                    yield raised

    def _raised(self, q: Array, height: float) -> Array | None:
        """The posture with the flange so much higher (m); None where it is not to be used."""
        T, arm = self._arm.fk(q), self._arm
        try:
            raised = arm.ik(SE3(T.rotation, T.translation + height * self._up), q)
        except Unreachable:
            return None
        margin = np.radians(self._reach.config.limit_deg)
        free = arm.limit_margin(raised) >= margin and self._reach.cell.touching(raised) is None
        return raised if free else None

    def _quickest(self, qs: Array) -> Path | None:
        """From the first posture to the second over any of the others.

        Dijkstra (1959) on durations; a straight way is checked for contact only once the
        quickest route takes it.
        """
        costs = np.array([[self.duration(a, b) for b in qs] for a in qs])
        costs[0, 1] = costs[1, 0] = np.inf  # known not to be free
        free: set[frozenset[int]] = set()
        while True:
            duration, before = dijkstra(costs, indices=0, return_predecessors=True)
            if not np.isfinite(duration[1]):
                return None
            route = _route(before)
            for edge in pairwise(route):
                if frozenset(edge) in free:
                    continue
                if self.contact(qs[edge[0]], qs[edge[1]]) is not None:
                    costs[edge] = costs[edge[::-1]] = np.inf
                    break
                free.add(frozenset(edge))
            else:
                return Path(qs[route], float(duration[1]))


def _route(before: Array) -> list[int]:
    """Nodes from 0 to 1, given the one before each on the quickest route."""
    route = [1]
    while route[-1] != 0:
        route.append(int(before[route[-1]]))
    return route[::-1]
