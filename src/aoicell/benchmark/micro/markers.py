"""The kinds of markers side by side on the same squares: accuracy, recall, false accepts, time."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.nominal import Nominal, View, load_nominal
from aoicell.observation import Image
from aoicell.resources import data_root
from aoicell.sim.drawing import draw, stream
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World
from aoicell.targets.cross_marker import turned
from aoicell.targets.marker import MARKERS, Marker, sight_markers
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.targets.pose import rms
from aoicell.transforms import SE3, Array, rotation, translation

SEED = 20210613
PICTURES, QUICK_PICTURES = 3, 1  # of each condition and view
NEAR_PX = 3.0  # a marker that is found farther from where it is counts as a false one


@dataclass(frozen=True)
class Condition:
    """What the pictures are taken under: error sources over `typical`, and the views."""

    name: str
    knobs: dict[str, float] = field(default_factory=dict)
    views: tuple[str, ...] = ("far", "near")


CONDITIONS = (
    Condition("far", views=("far",)),
    Condition("near", views=("near",)),
    Condition("tilted", views=("tilted",)),
    Condition("blurred", {"psf_px": 1.8}),
    Condition("noisy", {"noise_grey": 8.0, "electrons_per_grey": 5.0}),
    Condition("glare", {"glare": 1.0}),
    Condition("covered", {"occlusion_percent": 10.0}),
)


@dataclass(frozen=True, eq=False)
class Shown:
    """A picture, its lens, and where each whole marker of the board truly is in it.

    `markers`: code ("" for none) and points (4, 2) px.
    """

    kind: str
    condition: str
    grey: Image
    camera: Camera
    markers: Sequence[tuple[str, Array]]


def bench_markers(quick: bool = False) -> dict[str, Any]:
    """Each kind of marker in the pictures of the server board that bears it, and of the others.

    At 0.5 m over a marker, at 1.15 m over the whole board, tilted by 33 degrees, and with blur,
    noise, glare and 10 % of each edge covered, over profile `typical`; the board is shifted and
    turned about the view at random. `rms_px` are distances of the four points from the truth, over
    all of a kind's markers; `recall` the share of its markers that were found; `false_accepts`
    what else was taken for one, in all pictures: among the board's components and on the markers
    of the other kinds; `ms` CPU time of one picture on one thread; `over_sigma` the error in the
    standard deviations that the detector states.
    """
    nominal = load_nominal(data_root() / "cell")
    cells = {kind: nominal.with_markers(kind) for kind in MARKERS}
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        pictures = [
            shown
            for kind, cell in cells.items()
            for condition in CONDITIONS
            for shown in _pictures(cell, kind, condition, QUICK_PICTURES if quick else PICTURES)
        ]
        scores = [
            _score(kind, cell.marker, shown) for shown in pictures for kind, cell in cells.items()
        ]
    finally:
        cv2.setNumThreads(threads)
    rows = [
        {"kind": kind, "condition": condition.name, **_summary(kind, chosen)}
        for kind in cells
        for condition in CONDITIONS
        if (chosen := [s for s in scores if s.kind == kind and s.condition == condition.name])
    ]
    overall = {kind: _summary(kind, [s for s in scores if s.kind == kind]) for kind in cells}
    ratios = {
        key: {kind: summary[key] for kind, summary in overall.items()}
        for key in ("rms_px", "recall", "false_accepts", "ms")
    }
    return {"name": "markers", "rows": rows, "ratios": ratios}


# -- Pictures -----------------------------------------------------------------------------------


def _pictures(nominal: Nominal, kind: str, condition: Condition, count: int) -> Iterator[Shown]:
    tolerances = TYPICAL.model_copy(update=condition.knobs)
    world = World(nominal, draw(nominal, tolerances, SEED))
    T_base_board = world.T_base_board
    try:
        for name in condition.views:
            T_board_target, view = _views(nominal)[name]
            T_base_flange = (
                nominal.T_base_board * T_board_target * view.T_target_camera
                * nominal.T_flange_camera.inverse()
            )  # fmt: skip
            q = nominal.arm.ik(T_base_flange, nominal.q_home, name)
            for index in range(count):
                rng = stream(SEED, 0, index, f"markers_{name}")
                world.place_board(T_base_board * _moved(T_board_target, rng))
                world.begin(index)
                world.arrive(q)
                yield Shown(kind, condition.name, world.picture("hand"), world.camera("hand"),
                            _truth(world))  # fmt: skip
    finally:
        world.close()


def _views(nominal: Nominal) -> dict[str, tuple[SE3, View]]:
    over_marker = nominal.T_board_positioning
    tilted = View("tilted", nominal.check.distance, (np.radians(25), np.radians(22)), 0.1)
    return {
        "far": (SE3.Identity(), nominal.overview),
        "near": (over_marker, nominal.check),
        "tilted": (over_marker, tilted),
    }


def _moved(T_board_target: SE3, rng: np.random.Generator) -> SE3:
    """A turn of the board about a target on it, by any angle, and a shift of up to 20 mm."""
    x, y = rng.uniform(-0.02, 0.02, 2)
    turn = rotation("z", rng.uniform(-np.pi, np.pi))
    return T_board_target * translation(x, y) * turn * T_board_target.inverse()


def _truth(world: World) -> list[tuple[str, Array]]:
    marker, camera = world.nominal.marker, world.camera("hand")
    T_camera_board = world.truth().T_camera_board
    return [
        (design.code, world.project(world.marker_crosses(design.id)))
        for design in world.nominal.board.markers
        if camera.sees(world.marker_points(design.id, marker.outline), T_camera_board, 2.0)
    ]


# -- Scores -------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Score:
    """One detector on one picture: errors (N, 2) px of the points that it found, their stated
    deviations (N,) px, how many markers it found of how many, and how many that are none.
    """

    kind: str
    condition: str
    own: bool
    errors_px: Array
    sigma_px: Array
    found: int
    shown: int
    false: int
    seconds: float


def _score(kind: str, marker: Marker, picture: Shown) -> Score:
    own = picture.kind == kind
    start = time.thread_time()  # what others compute meanwhile does not count
    sightings = sight_markers(marker, picture.grey, picture.camera)
    seconds = time.thread_time() - start
    left = list(picture.markers) if own else []
    shown, errors, sigmas, false = len(left), [np.empty((0, 2))], [np.empty(0)], 0
    for seen in sightings:
        index = next((k for k, truth in enumerate(left) if _is(seen, truth)), None)
        if index is None:
            false += 1
        else:
            errors.append(_error(seen, left.pop(index)[1]))
            sigmas.append(seen.sigma_px)
    return Score(kind, picture.condition, own, np.concatenate(errors), np.concatenate(sigmas),
                 shown - len(left), shown, false, seconds)  # fmt: skip


def _is(seen: MarkerSighting, truth: tuple[str, Array]) -> bool:
    code, uv = truth
    return (seen.code or "") == code and bool(np.abs(_error(seen, uv)).max() < NEAR_PX)


def _error(seen: MarkerSighting, uv_true: Array) -> Array:
    """Found minus true points (4, 2) px; without a code in the nearest of the four readings."""
    readings = range(1 if seen.code is not None else 4)
    return min((turned(seen.uv_px, k) - uv_true for k in readings), key=lambda e: np.abs(e).max())


def _summary(kind: str, scores: Sequence[Score]) -> dict[str, Any]:
    mine = [score for score in scores if score.own]
    errors = np.concatenate([score.errors_px for score in mine])
    sigma = np.concatenate([score.sigma_px for score in mine])
    found, shown = sum(s.found for s in mine), sum(s.shown for s in mine)
    return {
        "rms_px": round(rms(errors), 4) if len(errors) else None,
        "over_sigma": round(float(rms(errors / sigma[:, None]) / np.sqrt(2)), 2) if found else None,
        "recall": round(found / shown, 4) if shown else None,
        "markers": shown,
        "false_accepts": sum(score.false for score in scores),
        "pictures": len(scores),
        "ms": round(1e3 * float(np.median([score.seconds for score in mine])), 2),
    }
