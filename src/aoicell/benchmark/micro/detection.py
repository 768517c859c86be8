"""How long two boards in a 2 MP picture take, beside OpenCV's own detector of exact corners."""

import statistics
import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike

from aoicell.calibration.poses import SETUP_MOTIONS
from aoicell.nominal import Nominal, load_nominal
from aoicell.observation import Image
from aoicell.resources import data_root
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World
from aoicell.targets.chessboard import Chessboard, half_turn
from aoicell.targets.pose import rms
from aoicell.transforms import Array

ROUNDS, QUICK_ROUNDS = 9, 3

Pair = tuple[Array, Array]


def bench_detection(quick: bool = False) -> dict[str, Any]:
    """Both chessboards in the tripod's pictures of a `typical` world: CPU time, on one thread.

    Each picture is searched once a round by either detector, one after the other. OpenCV's is
    findChessboardCornersSB at full size, twice: the board that it finds first is painted over.
    `two_boards_ms` is the median over all of ours, `over_opencv` that of ours over OpenCV's;
    a row's `rms_px` are distances from the true corners, over both boards.
    """
    nominal = load_nominal(data_root() / "cell")
    shown = _pictures(nominal)[: 3 if quick else None]
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        rows = [
            _row(nominal.tabletarget, picture, truth, index, QUICK_ROUNDS if quick else ROUNDS)
            for index, (picture, truth) in enumerate(shown, start=1)
        ]
    finally:
        cv2.setNumThreads(threads)
    ours = [took for row in rows for took in row.pop("_ours")]
    ratios = [ratio for row in rows for ratio in row.pop("_ratios")]
    return {
        "name": "detection",
        "rows": rows,
        "ratios": {
            "two_boards_ms": round(1e3 * statistics.median(ours), 2),
            "over_opencv": round(statistics.median(ratios), 4),
        },
    }


def _pictures(nominal: Nominal) -> list[tuple[Image, Pair]]:
    """The tripod's pictures of the world set-up, and where both boards' corners are in them."""
    world = World(nominal, draw(nominal, TYPICAL, seed=0))
    try:
        q_setup = nominal.arm.ik(nominal.T_base_flange_setup, nominal.q_home, "world set-up")
        shown = []
        for dT in SETUP_MOTIONS:
            world.arrive(nominal.arm.ik(nominal.T_base_flange_setup * dT, q_setup, "world set-up"))
            shown.append((world.picture("tripod"), _truth(world)))
        return shown
    finally:
        world.close()


def _truth(world: World) -> Pair:
    camera, T_tripod_base = world.geometry.cameras["tripod"], world.geometry.T_base_tripod.inverse()
    near = T_tripod_base * world.T_base_body("armtarget")
    far = T_tripod_base * world.geometry.T_base_tabletarget
    nominal = world.nominal
    return (
        camera.project(nominal.armtarget.corners, near),
        camera.project(nominal.tabletarget.corners, far),
    )


def _row(board: Chessboard, picture: Image, truth: Pair, index: int, rounds: int) -> dict[str, Any]:
    ours, opencv = [], []
    for _ in range(rounds):
        found, took = _timed(lambda: board.detect_pair(picture))
        ours.append(took)
        theirs, took = _timed(lambda: _by_opencv(board, picture))
        opencv.append(took)
    ratios = [a / b for a, b in zip(ours, opencv, strict=True)]
    return {
        "picture": index,
        "ms": round(1e3 * statistics.median(ours), 2),
        "opencv_ms": round(1e3 * statistics.median(opencv), 2),
        "over_opencv": round(statistics.median(ratios), 4),
        "rms_px": _rms_px(found, truth),
        "opencv_rms_px": _rms_px(theirs, truth),
        "_ours": ours,
        "_ratios": ratios,
    }


def _timed(work: Callable[[], Pair | None]) -> tuple[Pair | None, float]:
    start = time.thread_time()  # what others compute meanwhile does not count
    return work(), time.thread_time() - start


def _by_opencv(board: Chessboard, picture: Image) -> Pair | None:
    """Both boards, the larger image first; None where one was not found."""
    found = []
    for _ in range(2):
        ok, corners = cv2.findChessboardCornersSB(picture, (board.columns, board.rows))
        if not ok:
            return None
        found.append(np.asarray(corners, dtype=float).reshape(-1, 2))
        picture = board.hidden(picture, found[-1])
    found.sort(key=board.square_px, reverse=True)
    return found[0], found[1]


def _rms_px(found: Pair | None, truth: Pair) -> float | None:
    """Over both boards, each in the better one of its readings."""
    if found is None:
        return None
    squares = [
        min(_off(uv, expected), _off(half_turn(uv), expected)) ** 2
        for uv, expected in zip(found, truth, strict=True)
    ]
    return round(float(np.sqrt(np.mean(squares))), 4)


def _off(uv_px: Array, expected_px: ArrayLike) -> float:
    return rms(uv_px - np.asarray(expected_px))
