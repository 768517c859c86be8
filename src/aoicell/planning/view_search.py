"""The search for few views that show everything: a set cover, from the area bound upwards.

Greedy choice among candidate views, then each view in turn is exchanged for the one that adds most
to the others, and at last moved in small steps. Value of a set: the sum over the features of the
best that one of its views shows (`Inspector.values`), and a little for a marker in each picture.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.errors import InputError
from aoicell.nominal import View
from aoicell.planning.coverage import SEEN, Inspector, Limits
from aoicell.transforms import Array

Reachable = Callable[[View], bool]

_MARKER_MARGIN = 10.0  # px around a marker's plate: it may serve, it does not have to
_MARKER_WORTH = 5.0  # less than a feature, more than how well a handful of them is seen
_EXCHANGES, _ROUNDS = 12, 6  # at most; they end when nothing gets better
_STEPS = (0.03, 0.012, 0.004)  # of the last moves (m)
_CLOSE = 40  # features that small steps may bring, at most
_NEVER = -1e9
_NAMED = 5  # features out of reach: no more are looked for


@dataclass(frozen=True)
class SearchConfig:
    """Which views are tried: on a grid over the board, for each of the rolls.

    `stages`: a tilt (deg) and distances, 0 for the nearest that is in focus, 1 for the farthest
    that resolves the board's plane; one stage after the other, until every feature is shown by
    some view. A roll of some degrees keeps printed edges from running along the pixel raster.
    """

    step_share: float = 0.09  # of the field of view, between neighbouring aims
    rolls_deg: tuple[float, ...] = (5.0, 95.0)
    stages: tuple[tuple[tuple[float, float], tuple[float, ...]], ...] = (
        ((0, 0), (0.85, 0.4)),
        ((0, 0), (0.6, 0.05)),
        *((tilt, (0.7, 0.2)) for tilt in ((15, 0), (-15, 0), (0, 15), (0, -15))),
        *((tilt, (0.5,)) for tilt in ((30, 0), (-30, 0), (0, 30), (0, -30))),
    )
    most_views: int = 60
    restarts: int = 6


def distances(camera: Camera, limits: Limits) -> tuple[float, float]:
    """The nearest distance (m) that is in focus, the farthest that resolves the board's plane.

    Raises InputError when there is none between them.
    """
    far = camera.focal_px / limits.px_per_mm / 1e3
    blur = limits.blur_px / (camera.focal_px * limits.aperture)
    near, focused = 1 / (1 / limits.focus + blur), 1 / max(1 / limits.focus - blur, 1e-9)
    if near < far:
        return max(near, far / 2), min(far, focused)
    raise InputError(
        f"{limits.px_per_mm:g} px/mm take a distance of {far * 1e3:.0f} mm at most, and the lens "
        f"is in focus from {near * 1e3:.0f} mm on; ask for "
        f"{camera.focal_px / near / 1e3:.1f} px/mm or less"
    )


def markers_in(board: BoardDesign, camera: Camera, view: View) -> tuple[str, ...]:
    """Ids of the markers whose whole plate lies in a view's picture."""
    T_camera_board = view.T_target_camera.inverse()
    found = []
    for marker in board.markers:
        plate = marker.plate()
        ps = np.column_stack([plate, np.full(len(plate), marker.z)])
        if camera.sees(ps, T_camera_board, _MARKER_MARGIN):
            found.append(marker.id)
    return tuple(found)


class ViewSearch:
    """Candidate views with their values (C, F); which are reached is asked when one is wanted.

    `known` (F,) tells which features any candidate shows.
    """

    def __init__(
        self, inspector: Inspector, board: BoardDesign, reachable: Reachable, config: SearchConfig
    ) -> None:
        self._inspector, self._board = inspector, board
        self._reachable, self._config = reachable, config
        self._views, self._values = self._candidates()
        self._extra = np.array([self._bonus(view) for view in self._views])
        self._asked: dict[int, bool] = {}
        self._moved: dict[View, Array] = {}
        self.known = np.asarray(self._values.max(axis=0) > 0)
        if not self.known.any():
            raise InputError(
                f"plan: no view shows any target of {board.name} at "
                f"{inspector.scene.limits.px_per_mm:g} px/mm; ask for fewer"
            )
        self._check_reach()

    def _candidates(self) -> tuple[list[View], Array]:
        """Views with their values, stage by stage while a feature is shown by none."""
        scene, views = self._inspector.scene, list[View]()
        values = np.zeros((0, len(scene.features)))
        for tilt_deg, shares in self._config.stages:
            if values.max(axis=0, initial=0).all():
                break
            more = list(self._grid(tilt_deg, shares))
            found = np.array([self._inspector.values(view) for view in more])
            views, values = [*views, *more], np.vstack([values, found])
        return views, values

    def _grid(self, tilt_deg: tuple[float, float], shares: Sequence[float]) -> Iterator[View]:
        camera, limits = self._inspector.scene.camera, self._inspector.scene.limits
        near, far = distances(camera, limits)
        step = self._config.step_share * (camera.width + camera.height) / 2 / limits.px_per_mm / 1e3
        xs, ys = (_spread(side, step) for side in self._board.size[:2])
        a, b = map(math.radians, tilt_deg)
        for share, roll, x, y in product(shares, self._config.rolls_deg, xs, ys):
            yield _rounded(
                View("", near + share * (far - near), (a, b), math.radians(roll), (x, y, 0.0))
            )

    def _bonus(self, view: View) -> float:
        return _MARKER_WORTH * bool(markers_in(self._board, self._inspector.scene.camera, view))

    # -- Reach ------------------------------------------------------------------------------

    def _can(self, index: int) -> bool:
        if index not in self._asked:
            self._asked[index] = self._reachable(self._views[index])
            if not self._asked[index]:
                self._values[index] = 0
                self._extra[index] = _NEVER
        return self._asked[index]

    def _check_reach(self) -> None:
        """Raise unless every known feature is shown by a candidate that the arm reaches."""
        open_ = self.known.copy()
        beyond: list[str] = []
        for feature in map(int, np.argsort((self._values > 0).sum(axis=0), kind="stable")):
            while open_[feature] and len(beyond) < _NAMED:
                index = int(self._values[:, feature].argmax())
                if self._values[index, feature] == 0:
                    beyond.append(self._inspector.scene.features[feature].target)
                    open_[feature] = False
                elif self._can(index):
                    open_ &= self._values[index] == 0
        if not beyond:
            return
        shown = ", ".join(dict.fromkeys(beyond))
        width, depth = self._board.size[0] * 1e3, self._board.size[1] * 1e3
        raise InputError(
            f"{self._board.name}, {width:.0f} x {depth:.0f} mm, is larger than the arm's reach "
            f"where it lies: no view of {shown} is reached without contact, for one; move it closer"
        )

    # -- Choice -----------------------------------------------------------------------------

    def cover(self, start: int) -> list[View]:
        """From the area bound upwards the first number of views that suffices."""
        views: list[View] = []
        for count in range(max(1, start), self._config.most_views + 1):
            found = dict.fromkeys(tuple(sorted(chosen)) for chosen in self._sets(count))
            for chosen in sorted(found, key=self._worth, reverse=True):
                if self._worth(chosen) < SEEN * (self.known.sum() - _CLOSE):
                    break  # more is missing than small steps bring
                views = self._polished(chosen)
                if self._complete(views):
                    return views
        return views

    def _sets(self, count: int) -> Iterator[list[int]]:
        """Sets of candidates to go on from: tilings of the board as they are and with exchanged
        views, and greedy sets, all but the first of which begin with a view drawn at random.
        """
        for tiling in self._tilings(count):
            yield tiling
            yield self._exchanged(list(tiling))
        rng = np.random.default_rng(0)
        for restart in range(self._config.restarts):
            chosen = [] if restart == 0 else [int(rng.integers(len(self._views)))]
            while len(chosen) < count:
                chosen.append(self._best_beside(chosen))
            yield self._exchanged(chosen)

    def _tilings(self, count: int) -> Iterator[list[int]]:
        """In equal rows and columns, for each roll and distance the candidates next to the tiles'
        centres; only those that the arm reaches.
        """
        places = np.array([view.aim[:2] for view in self._views])
        upright = np.array([view.tilt == (0.0, 0.0) for view in self._views])
        kinds = np.array([(view.roll, view.distance) for view in self._views])
        for kind, columns in product(np.unique(kinds[upright], axis=0), range(1, count + 1)):
            if count % columns:
                continue
            alike = np.flatnonzero(upright & (kinds == kind).all(axis=1))
            width, depth, _ = self._board.size
            xs, ys = _spread(width, width / columns), _spread(depth, depth / (count // columns))
            tiles = product(xs, ys)
            found = [int(alike[np.linalg.norm(places[alike] - t, axis=1).argmin()]) for t in tiles]
            if all(self._can(index) for index in found):
                yield found

    def _exchanged(self, chosen: list[int]) -> list[int]:
        for _ in range(_EXCHANGES):
            before = list(chosen)
            for place in range(len(chosen)):
                chosen[place] = self._best_beside(chosen[:place] + chosen[place + 1 :])
            if chosen == before:
                break
        return chosen

    def _best_beside(self, others: Sequence[int]) -> int:
        """The candidate that adds most to the others, among those that the arm reaches."""
        have = self._values[list(others)].max(axis=0, initial=0)
        worth = np.maximum(have, self._values).sum(axis=1) + self._extra
        while True:
            index = int(worth.argmax())
            if self._can(index):
                return index
            worth[index] = -np.inf

    def _worth(self, chosen: Sequence[int]) -> float:
        own = list(chosen)
        return float(self._values[own].max(axis=0).sum() + self._extra[own].sum())

    def _complete(self, views: Sequence[View]) -> bool:
        seen = np.any([self._inspector.seen(view) for view in views], axis=0)
        return bool(seen[self.known].all())

    # -- Small steps ------------------------------------------------------------------------

    def _polished(self, chosen: Sequence[int]) -> list[View]:
        """The chosen views moved, leant and brought nearer in small steps while it helps."""
        views = [self._views[k] for k in chosen]
        values = [self._shown(view) for view in views]
        for step in _STEPS:
            for _ in range(_ROUNDS):
                before = list(views)
                for place, view in enumerate(views):
                    others = [v for k, v in enumerate(values) if k != place]
                    have = np.max(others, axis=0, initial=0)
                    views[place], values[place] = self._better(view, values[place], have, step)
                if views == before:
                    break
        return views

    def _shown(self, view: View) -> Array:
        """Values (F,) of a view, worked out once: small steps come by the same views again."""
        if view not in self._moved:
            self._moved[view] = self._inspector.values(view)
        return self._moved[view]

    def _better(self, view: View, own: Array, have: Array, step: float) -> tuple[View, Array]:
        """The best of a view and its neighbours, beside other views that show `have` (F,)."""
        best, best_values, worth = view, own, self._sum(have, own, view)
        for neighbour in _moved(view, step):
            values = self._shown(neighbour)
            gain = self._sum(have, values, neighbour)
            if gain > worth + 1e-6 and self._reachable(neighbour):
                best, best_values, worth = neighbour, values, gain
        return best, best_values

    def _sum(self, others: Array, own: Array, view: View) -> float:
        return float(np.maximum(others, own).sum()) + self._bonus(view)


def _spread(length: float, step: float) -> list[float]:
    count = max(1, math.ceil(length / step))
    return [length * ((k + 0.5) / count - 0.5) for k in range(count)]


def _moved(view: View, step: float) -> Iterator[View]:
    """Neighbours of a view at a step (m); a lean moves the picture on the board by as much."""
    x, y, z = view.aim
    a, b = view.tilt
    turn = step / view.distance
    for sign in (step, -step):
        yield _rounded(replace(view, aim=(x + sign, y, z)))
        yield _rounded(replace(view, aim=(x, y + sign, z)))
        yield _rounded(replace(view, distance=view.distance + sign))
    for sign in (turn, -turn):
        yield _rounded(replace(view, tilt=(a + sign, b)))
        yield _rounded(replace(view, tilt=(a, b + sign)))


def _rounded(view: View) -> View:
    """As it is written: whole millimetres, tenths of a degree."""
    degrees = np.round(np.degrees([*view.tilt, view.roll]), 1)
    a, b, roll = map(float, np.radians(degrees))
    x, y, z = (round(float(value), 3) for value in view.aim)
    return replace(view, aim=(x, y, z), distance=round(view.distance, 3), tilt=(a, b), roll=roll)
