"""Which worker does which trial: each stays in the world that it has calibrated."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from aoicell.benchmark.work import Task
from aoicell.scenario import Case

JOIN_AT = 8  # preparing a world takes about as long as so many of its trials


@dataclass(eq=False)
class _Place:
    """A world of a case, and its trials that are yet to be done."""

    case: Case
    world: int
    first_number: int
    pending: deque[int] = field(default_factory=deque)

    def take(self) -> Task:
        trial = self.pending.popleft()
        return Task(self.case, self.world, trial, self.first_number + trial)


class Schedule:
    """Hands out trials: of the worker's own world, else of a new one, else of one in progress."""

    def __init__(
        self, cases: Sequence[Case], done: Callable[[int, int], set[int]], only: int | None = None
    ) -> None:
        """`done` tells the trials of a case's world that need no repeating."""
        self._fresh = _places(cases, done, only)
        self._begun: list[_Place] = []
        self._own: dict[int, _Place] = {}

    def next_for(self, worker: int) -> Task | None:
        """A trial for a worker (its index); None when there is nothing for it to do."""
        place = self._own.get(worker)
        if place is None or not place.pending:
            place = next(self._fresh, None) or self._to_join()
            if place is None:
                return None
            self._own[worker] = place
            self._begun = [p for p in (*self._begun, place) if p.pending]
        return place.take()

    def _to_join(self) -> _Place | None:
        """The world with most to do, when helping there is worth its preparation."""
        left = [p for p in self._begun if p.pending]
        place = max(left, key=lambda p: len(p.pending), default=None)
        if place is None:
            return None
        alone = place in self._own.values()
        return place if len(place.pending) >= JOIN_AT or not alone else None

    def give_back(self, worker: int, tasks: Sequence[Task]) -> None:
        """The worker died over these trials; whoever is free next takes them."""
        self._own.pop(worker, None)
        for task in reversed(tasks):
            self._place_of(task).pending.appendleft(task.trial)

    def _place_of(self, task: Task) -> _Place:
        for place in self._begun:
            if (place.case.index, place.world) == (task.case.index, task.world):
                return place
        place = _Place(task.case, task.world, task.number - task.trial)
        self._begun.append(place)
        return place


def _places(
    cases: Sequence[Case], done: Callable[[int, int], set[int]], only: int | None
) -> Iterator[_Place]:
    """All worlds with something to do, one after the other."""
    number = 0
    for case in cases:
        trials = case.scenario.trials_per_world
        for world in range(case.scenario.worlds):
            finished = done(case.index, world)
            pending = [t for t in range(trials) if t not in finished and only in (None, number + t)]
            if pending:
                yield _Place(case, world, number, deque(pending))
            number += trials
