"""A virtual touch test: how near a probe comes to points of the board that the camera located.

The arm carries a probe whose tip is known on the nominal flange. It is driven to points of the
board as a calibration has them, and the distance that is left is taken from the truth: camera,
hand-eye and arm show in it together, and nothing cancels as it does between two views.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from aoicell.benchmark.trial import senses
from aoicell.errors import Refused
from aoicell.nominal import Nominal, load_nominal
from aoicell.observation import Cell, Observation, capture_at
from aoicell.pipeline import (
    METHODS,
    Calibration,
    Method,
    calibrate,
    flange_target,
    photograph_targets,
)
from aoicell.registration import designed_layout
from aoicell.resources import data_root
from aoicell.scenario import Scenario
from aoicell.sim.drawing import draw
from aoicell.sim.world import World
from aoicell.targets.detector import Detector
from aoicell.targets.layout import Layout, locate_layout
from aoicell.transforms import SE3, Array, apply, rotation

PROFILES = ("typical", "paper")
NAMES = ("paper", "aoicell")
WORLDS, QUICK_WORLDS = 20, 3
POINTS = 24
TIP = np.array([0.03, -0.02, 0.18])  # m, in the flange: beyond the camera and beside it
# The probe leans as it would between components: (rad) about the flange's x and y.
LEANS = tuple((float(np.radians(x)), float(np.radians(y)))
              for x, y in ((0, 0), (15, 0), (-15, 0), (0, 15), (0, -15)))  # fmt: skip


@dataclass(frozen=True)
class Touches:
    """Distances (mm) of the tip from its points in one world, and why a method had none."""

    distances_mm: tuple[float, ...]
    refused: str = ""


def bench_touch(quick: bool = False) -> dict[str, Any]:
    """Distance of the tip from its point in mm, over worlds of two profiles and two methods.

    Points are projected, not rendered. Each method locates the board as it does online: `paper`
    by the positioning marker from P_check, `aoicell` by all of them from the overview.
    """
    nominal = load_nominal(data_root() / "cell")
    count = QUICK_WORLDS if quick else WORLDS
    rows = []
    for profile in PROFILES:
        found = [touch_world(nominal, profile, index) for index in range(count)]
        rows += [_row(profile, name, [touches[name] for touches in found]) for name in NAMES]
    means = {(row["profile"], row["method"]): row["mean_mm"] for row in rows}
    ratios = {}
    for profile in PROFILES:
        paper, aoicell = (means[profile, name] for name in NAMES)
        if paper is not None and aoicell is not None:
            ratios[f"aoicell_{profile}_mm"] = aoicell
            ratios[f"paper_over_aoicell_{profile}"] = round(paper / aoicell, 2)
    return {"name": "touch", "rows": rows, "ratios": ratios}


def touch_world(nominal: Nominal, profile: str, index: int, seed: int = 0) -> Mapping[str, Touches]:
    """One world calibrated, its board located and touched, by each method."""
    scenario = Scenario(name="touch", profile=profile, seed=seed, pictures=False)
    world = World(nominal, draw(nominal, scenario.tolerances, seed, index), pictures=False)
    try:
        cell, detector = senses(scenario, world)
        methods = [METHODS[name] for name in NAMES]
        calibrations = calibrate(photograph_targets(cell, nominal), nominal, methods, detector)
        looks = _looks(cell, nominal)
        return MappingProxyType(
            {m.name: _touch(world, looks, calibrations[m.name], m, detector) for m in methods}
        )
    finally:
        world.close()


def _looks(cell: Cell, nominal: Nominal) -> tuple[Observation, Observation]:
    """The pictures that locate the board: from P_check and from above."""
    T_base_marker = nominal.T_base_board * nominal.T_board_positioning
    q_check = flange_target(nominal, T_base_marker, nominal.check, nominal.q_home)
    q_overview = flange_target(nominal, nominal.T_base_board, nominal.overview, q_check)
    check, overview = capture_at(cell, [q_check, q_overview])
    return check, overview


def _touch(
    world: World, looks: tuple[Observation, Observation], calibration: Calibration,
    method: Method, detector: Detector,
) -> Touches:  # fmt: skip
    """Drives the tip to each point and measures, from the truth, where it got."""
    nominal, (check, _) = world.nominal, looks
    points = touch_points(nominal)
    try:
        T_base_board = locate_board(nominal, looks, calibration, method, detector)
        qs = [
            _posture(nominal, calibration, T_base_board.act(p), check.state.q, k)
            for k, p in enumerate(points)
        ]
    except Refused as reason:
        return Touches((), str(reason))
    world.begin()  # the same arrivals for each method
    distances = []
    for q, p in zip(qs, points, strict=True):
        world.arrive(q)
        tip = world.T_base_body("arm/flange").act(TIP)
        distances.append(float(np.linalg.norm(tip - world.T_base_board.act(p))) * 1e3)
    return Touches(tuple(distances))


def touch_points(nominal: Nominal, count: int = POINTS) -> Array:
    """Tops of components (count, 3) spread over the board, in its frame."""
    tops = np.array([[c.x, c.y, c.top] for c in nominal.board.components])
    chosen = [int(np.linalg.norm(tops[:, :2] - tops[:, :2].mean(axis=0), axis=1).argmax())]
    while len(chosen) < min(count, len(tops)):  # the one farthest from those chosen
        gaps = np.linalg.norm(tops[:, None, :2] - tops[None, chosen, :2], axis=2).min(axis=1)
        chosen.append(int(gaps.argmax()))
    return tops[chosen]


def locate_board(
    nominal: Nominal, looks: tuple[Observation, Observation], calibration: Calibration,
    method: Method, detector: Detector,
) -> SE3:  # fmt: skip
    """T_base_board as a method has it: by one marker from P_check, or by all from above."""
    check, overview = looks
    layout: Layout = designed_layout(nominal.board, nominal.marker)
    shown = overview
    if not method.all_markers:
        shown, id = check, nominal.positioning.id
        layout = {id: apply(nominal.T_board_positioning, nominal.marker.crosses)}
    T_base_camera = calibration.T_base_camera(shown.state)
    found = (method.detector or detector).markers(shown, nominal.marker)
    expected = T_base_camera.actInv(nominal.T_base_board)
    located = locate_layout(found, layout, calibration.hand.camera, expected)
    return T_base_camera * located.T_camera_target


def _posture(
    nominal: Nominal, calibration: Calibration, place: Array, q_check: Array, k: int
) -> Array:
    """Joint angles (rad) that bring the tip to a place in the base, as the method has the arm.

    The wrist as at P_check, with the last joint in the middle of its range.
    """
    q_near = q_check.copy()
    q_near[-1] = (nominal.arm.lower[-1] + nominal.arm.upper[-1]) / 2
    x, y = LEANS[k % len(LEANS)]
    turned = (nominal.arm.fk(q_near) * rotation("x", x) * rotation("y", y)).rotation
    T_base_flange = SE3(turned, place - turned @ TIP)
    return calibration.arm.ik(T_base_flange, q_near, f"touch point {k + 1}")


def _row(profile: str, method: str, touches: Sequence[Touches]) -> dict[str, Any]:
    distances = np.array([d for t in touches for d in t.distances_mm])
    known = len(distances) > 0
    return {
        "profile": profile,
        "method": method,
        "worlds": len(touches),
        "refused": sum(bool(t.refused) for t in touches),
        "touches": len(distances),
        "mean_mm": round(float(distances.mean()), 4) if known else None,
        "p95_mm": round(float(np.percentile(distances, 95)), 4) if known else None,
        "max_mm": round(float(distances.max()), 4) if known else None,
    }
