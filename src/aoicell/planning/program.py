"""A robot program: moves and pictures, as planned for a set of views, and carried out.

    planned = plan_program(nominal, views)             # reach, order, paths, timing
    write_program(planned.program, folder / "program.json")   # aoicell.planning.program_file
    pictures = execute(load_program(path, nominal), cell)     # nothing but the program counts

`aoicell.report.joint_paths.joint_paths(program, nominal.arm)` draws it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from aoicell.errors import InputError, Unreachable
from aoicell.nominal import Nominal, View
from aoicell.observation import Cell, Observation
from aoicell.planning.order import best_order
from aoicell.planning.path import Path, Paths
from aoicell.planning.reach import Reach, ReachConfig, Reached
from aoicell.robot.collision import Solid
from aoicell.transforms import SE3, Array

DECIMALS = 6  # of a joint angle (deg): 0.03 um at the end of an arm of 1.6 m
PLAIN = "letters, digits, '.', '_', '-' as it names its picture, with none of '.', '-' first"
_AT_START_DEG = 0.1  # how far off its start a program may find the arm


@dataclass(frozen=True)
class Move:
    """A straight joint move from rest to rest.

    The angles are kept in degrees, rounded to what the file says, so that a program goes to
    exactly the same radians whether it was just planned or read from its file.
    """

    to: str
    joints_deg: tuple[float, ...]
    duration: float

    @property
    def q(self) -> Array:
        """Joint angles (dof,; rad)."""
        return np.radians(self.joints_deg)


@dataclass(frozen=True)
class Capture:
    """A picture by the hand camera, under the name of a view."""

    view: str


@dataclass(frozen=True)
class Program:
    """What a controller needs, and all that it gets: `arm` and `joints` name whose angles these
    are, `start_deg` is where the arm must stand.
    """

    name: str
    arm: str
    joints: tuple[str, ...]
    start_deg: tuple[float, ...]
    steps: tuple[Move | Capture, ...]

    @property
    def moves(self) -> tuple[Move, ...]:
        """The moves alone."""
        return tuple(step for step in self.steps if isinstance(step, Move))

    @property
    def views(self) -> tuple[str, ...]:
        """The views in the order of their pictures."""
        return tuple(step.view for step in self.steps if isinstance(step, Capture))

    @property
    def duration(self) -> float:
        """Of all moves (s); settling and exposures come on top."""
        return sum(move.duration for move in self.moves)


@dataclass(frozen=True)
class Planned:
    """A program, the postures of its views in the order of visits, and what the order gained.

    `given_duration` (s) is that of the moves in the order in which the views were given, inf
    where that order has no way without contact.
    """

    program: Program
    visits: tuple[Reached, ...]
    given_duration: float


def plan_program(
    nominal: Nominal,
    views: Sequence[View],
    *,
    T_base_board: SE3 | None = None,
    name: str = "inspection",
    config: ReachConfig | None = None,
    obstacles: Iterable[Solid] = (),
) -> Planned:
    """A round trip from home over the views of a board, by default where the design has it.

    Every posture is checked (`Reach`), every way is free of contact (`Paths`), the order is a
    quick one (`best_order`), and every move takes the time that the drives need. Raises
    Unreachable with a reason for each view that cannot be taken up, and InputError for views
    that share a name or whose name can name no file.
    """
    ids = [view.id for view in views]
    unfit = next((id for id in ids if not is_plain(id)), None)
    if unfit is not None:
        raise InputError(f"view '{unfit}': its name must be {PLAIN}")
    twice = next((id for index, id in enumerate(ids) if id in ids[:index]), None)
    if twice is not None:
        raise InputError(f"view '{twice}' is there twice; give each view a name of its own")
    reach = Reach(nominal, T_base_board, config, obstacles)
    reach.refuse_contact(nominal.q_home, "home")
    visits = _all_reached(reach, views)
    ways = _Ways(Paths(reach), [nominal.q_home, *(visit.q for visit in visits)], ["home", *ids])
    order = best_order(ways.at_least, ways.duration)
    given = sum(ways.duration(*way) for way in pairwise((0, *range(1, len(ids) + 1), 0)))
    program = Program(
        name=name,
        arm=nominal.arm.urdf.stem,
        joints=nominal.arm.joint_names,
        start_deg=in_degrees(nominal.q_home),
        steps=tuple(_steps(ways, (0, *order, 0))) if ids else (),
    )
    return Planned(program, tuple(visits[stop - 1] for stop in order), given)


def execute(program: Program, cell: Cell) -> Mapping[str, Observation]:
    """Carry a program out and return its pictures by view, in the order in which they were taken.

    Raises InputError when the arm does not stand where the program starts: from anywhere else
    the first way is not known to be free.
    """
    start, at = np.radians(program.start_deg), cell.state().q
    if at.shape != start.shape or np.abs(at - start).max() > np.radians(_AT_START_DEG):
        raise InputError(
            f"program '{program.name}' starts at {_shown(program.start_deg)} deg; the arm stands "
            f"at {_shown(in_degrees(at))} deg: drive it to the start first"
        )
    pictures = {}
    for step in program.steps:
        if isinstance(step, Move):
            cell.move(step.q)
        else:
            pictures[step.view] = cell.capture()
    return pictures


def is_plain(name: str) -> bool:
    """Whether a view's name can name a picture's file."""
    plain = all(c.isascii() and (c.isalnum() or c in "._-") for c in name)
    return bool(name) and plain and name[0] not in ".-"


def in_degrees(q: ArrayLike) -> tuple[float, ...]:
    """Joint angles (rad) as a program holds them (deg)."""
    return tuple(float(angle) for angle in np.round(np.degrees(q), DECIMALS) + 0.0)  # no -0.0


class _Ways:
    """The ways among a list of postures, planned when first asked for."""

    def __init__(self, paths: Paths, qs: Sequence[Array], names: Sequence[str]) -> None:
        self._paths, self._qs, self.names = paths, qs, names
        self._known: dict[tuple[int, int], Path | Unreachable] = {}
        self.at_least = np.array([[paths.duration(a, b) for b in qs] for a in qs])

    def duration(self, i: int, j: int) -> float:
        """Of the way between two postures (s), either direction; inf where there is none."""
        try:
            return self.path(min(i, j), max(i, j)).duration
        except Unreachable:
            return float("inf")

    def path(self, i: int, j: int) -> Path:
        """The way from one to another. Raises Unreachable when there is none."""
        if i > j:
            there = self.path(j, i)
            return Path(there.qs[::-1], there.duration)
        if (i, j) not in self._known:
            self._known[i, j] = self._planned(i, j)
        found = self._known[i, j]
        if isinstance(found, Unreachable):
            raise found
        return found

    def _planned(self, i: int, j: int) -> Path | Unreachable:
        name = f"from {self.names[i]} to {self.names[j]}"
        try:
            return self._paths.between(self._qs[i], self._qs[j], name)
        except Unreachable as error:
            return error

    def durations(self, path: Path) -> list[float]:
        """Of each move of a path (s)."""
        return [self._paths.duration(a, b) for a, b in pairwise(path.qs)]


def _all_reached(reach: Reach, views: Sequence[View]) -> list[Reached]:
    visits, refused = [], []
    for view in views:
        try:
            visits.append(reach.of(view))
        except Unreachable as error:
            refused.append(str(error))
    if refused:
        count = f"{len(refused)} of {len(views)} views cannot be taken up: "
        raise Unreachable((count if len(views) > 1 else "") + "; ".join(refused))
    return visits


def _steps(ways: _Ways, round_trip: Sequence[int]) -> Iterable[Move | Capture]:
    for i, j in pairwise(round_trip):
        path = ways.path(i, j)
        last = len(path.qs) - 1
        for index, duration in enumerate(ways.durations(path), start=1):
            to = ways.names[j] if index == last else f"on the way to {ways.names[j]}"
            yield Move(to, in_degrees(path.qs[index]), duration)
        if j:
            yield Capture(ways.names[j])


def _shown(angles_deg: Sequence[float]) -> str:
    return f"({', '.join(f'{angle:.1f}' for angle in angles_deg)})"
