"""How long a calibration takes: two boards in thirty 2 MP pictures, detection included."""

import os
import time
from typing import Any

import numpy as np

from aoicell.benchmark.workers import compute_on_one_thread
from aoicell.calibration.calibrate import calibrate
from aoicell.calibration.half_turns import settle_half_turns
from aoicell.calibration.poses import SETUP_MOTIONS
from aoicell.calibration.problem import CalibrationView, Eye, Fixture, Problem, Sight
from aoicell.calibration.selection import select
from aoicell.calibration.starts import sight_poses, start_estimate
from aoicell.nominal import Nominal, load_nominal
from aoicell.observation import Image
from aoicell.resources import data_root
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World
from aoicell.targets.pairs import sight_pair
from aoicell.transforms import SE3, Array, from_rvec

VIEWS, QUICK_VIEWS = 30, 10

Shot = tuple[Array, SE3, Image]


def bench_calibration(quick: bool = False) -> dict[str, Any]:
    """The tripod's pictures of both boards in a `typical` world, with the joint angles known.

    Seconds of CPU on one thread, part by part: `detection` of all pictures, `calibration` in all,
    and of that `start` (each target posed, half turns, closed forms) and `models` (all of them
    fitted and held out). `seconds` is what a calibration takes on one core.
    """
    compute_on_one_thread()
    nominal = load_nominal(data_root() / "cell")
    shots = _shots(nominal, QUICK_VIEWS if quick else VIEWS)
    spent: dict[str, float] = {}
    begin = time.process_time()
    boards = (nominal.armtarget, nominal.tabletarget)
    seen = [sight_pair(image, boards) for _, _, image in shots]
    spent["detection"] = time.process_time() - begin
    views = tuple(
        CalibrationView(
            f"{k}", T_base_flange,
            tuple(Sight("tripod", name, np.asarray(s.ids), s.uv_px)
                  for name, s in zip(("armtarget", "tabletarget"), pair, strict=True)), q,
        )
        for k, ((q, T_base_flange, _), pair) in enumerate(zip(shots, seen, strict=True))
    )  # fmt: skip
    fixtures = (
        Fixture("armtarget", nominal.armtarget.corners, "flange", half_turns=True),
        Fixture("tabletarget", nominal.tabletarget.corners, "base", half_turns=True),
    )
    eye = Eye("tripod", nominal.cameras["tripod"], "base")
    problem = Problem((eye,), fixtures, views, nominal.arm)
    begin = time.process_time()
    report = calibrate(problem)
    spent["calibration"] = time.process_time() - begin
    begin = time.process_time()
    posed = sight_poses(problem)
    readings = settle_half_turns(posed.problem, posed.poses)
    start = start_estimate(readings.problem, readings.poses, posed.rms_px)
    spent["start"] = time.process_time() - begin
    begin = time.process_time()
    select(readings.problem, start.estimate, start.noise)
    spent["models"] = time.process_time() - begin
    seconds = spent["detection"] + spent["calibration"]
    return {
        "name": "calibration",
        "views": len(shots),
        "verdict": report.verdict,
        "holdout_px": round(report.held_out_px, 3),
        "cores": os.cpu_count(),
        "rows": [{"part": part, "seconds": round(took, 2)} for part, took in spent.items()],
        "ratios": {
            "seconds": round(seconds, 2),
            "detection_share": round(spent["detection"] / seconds, 3),
        },
    }


def _shots(nominal: Nominal, count: int) -> list[Shot]:
    """Joint angles, the controller's pose and the picture at `count` poses about the set-up's."""
    world, rng = World(nominal, draw(nominal, TYPICAL, seed=0)), np.random.default_rng(0)
    try:
        T_setup = nominal.T_base_flange_setup
        q_setup = nominal.arm.ik(T_setup, nominal.q_home, "world set-up")
        shots = []
        for k in range(count):
            turn, shift = rng.uniform(-0.05, 0.05, 3), rng.uniform(-0.01, 0.01, 3)
            around = from_rvec(turn * (k >= len(SETUP_MOTIONS)), shift * (k >= len(SETUP_MOTIONS)))
            T = T_setup * SETUP_MOTIONS[k % len(SETUP_MOTIONS)] * around
            q = nominal.arm.ik(T, q_setup, f"view {k + 1}")
            world.arrive(q)
            shots.append((q, nominal.arm.fk(q), world.picture("tripod")))
        return shots
    finally:
        world.close()
