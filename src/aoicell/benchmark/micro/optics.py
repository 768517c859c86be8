"""What lens and sensor cost on top of the bare render of the same picture."""

import os
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import cv2

from aoicell.nominal import Nominal, load_nominal
from aoicell.pipeline import flange_target
from aoicell.resources import data_root
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World
from aoicell.transforms import Array

ROUNDS, QUICK_ROUNDS = 15, 3


def bench_optics(quick: bool = False) -> dict[str, Any]:
    """Optics over render, on grey pictures of the taught poses in a `typical` world.

    Each picture is rendered and exposed once a round, one after the other, on one thread; the
    render includes its way back from OpenGL. A row's ratio is the median over the rounds,
    `optics_over_render` the median over all of them.
    """
    nominal = load_nominal(data_root() / "cell")
    with _one_thread():
        world = World(nominal, draw(nominal, TYPICAL, seed=0))
        try:
            rows = [
                _row(world, name, q, QUICK_ROUNDS if quick else ROUNDS)
                for name, q in _taught(nominal).items()
            ]
        finally:
            world.close()
    ratios = [ratio for row in rows for ratio in row.pop("_ratios")]
    return {
        "name": "optics",
        "rows": rows,
        "ratios": {"optics_over_render": round(statistics.median(ratios), 4)},
    }


def _row(world: World, view: str, q: Array, rounds: int) -> dict[str, Any]:
    """Times of one view, after a first picture that fills the caches."""
    world.arrive(q)
    world.picture("hand")
    renders, optics = [], []
    for _ in range(rounds):
        before, start = world.render_seconds, time.perf_counter()
        world.picture("hand")
        took = time.perf_counter() - start
        renders.append(world.render_seconds - before)
        optics.append(took - renders[-1])
    ratios = [o / r for o, r in zip(optics, renders, strict=True)]
    return {
        "view": view,
        "pictures": rounds,
        "render_ms": round(1e3 * statistics.median(renders), 2),
        "optics_ms": round(1e3 * statistics.median(optics), 2),
        "optics_over_render": round(statistics.median(ratios), 4),
        "_ratios": ratios,
    }


def _taught(nominal: Nominal) -> dict[str, Array]:
    """Joint angles (rad) by view, as designed."""
    T_base_marker = nominal.T_base_board * nominal.T_board_positioning
    q_check = flange_target(nominal, T_base_marker, nominal.check, nominal.q_home)
    views = [nominal.overview, *nominal.inspection_views]
    names = ["overview", *(view.id for view in nominal.inspection_views)]
    return {
        "P_check": q_check,
        **{
            name: flange_target(nominal, nominal.T_base_board, view, q_check)
            for name, view in zip(names, views, strict=True)
        },
    }


@contextmanager
def _one_thread() -> Iterator[None]:
    """OpenCV on one thread, and Mesa too where no picture was rendered before."""
    threads, mesa = cv2.getNumThreads(), os.environ.get("LP_NUM_THREADS")
    cv2.setNumThreads(1)
    os.environ["LP_NUM_THREADS"] = "1"
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
        if mesa is None:
            del os.environ["LP_NUM_THREADS"]
        else:
            os.environ["LP_NUM_THREADS"] = mesa
