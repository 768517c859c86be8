"""How well hand-eye solvers predict the picture from arm poses that they have not seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any

import numpy as np

from aoicell.benchmark.micro.hand_eye_bound import Bound, bayesian_bound
from aoicell.benchmark.micro.hand_eye_solvers import (
    OURS,
    STRONGEST,
    Solved,
    Taken,
    answer,
    closed_form_names,
    gauge_freedoms,
    ours,
    solve_all,
    strongest_is_here,
)
from aoicell.calibration.candidates import CandidateConfig, candidates, hand_eye_start
from aoicell.calibration.planning import PlanningConfig, WorkView, plan_poses
from aoicell.calibration.poses import TABLE_2
from aoicell.errors import Refused
from aoicell.nominal import Nominal, load_nominal
from aoicell.observation import Cell
from aoicell.resources import data_root
from aoicell.sim.as_built import Arrival
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.projection import PicturelessCell, ProjectingDetector, measured_noise
from aoicell.sim.world import World
from aoicell.targets.chessboard import half_turn
from aoicell.targets.detector import IN_PICTURES, Detector
from aoicell.transforms import SE3, Array, apply, distance_deg, distance_mm

CELLS, QUICK_CELLS = 50, 3
RENDERED = 3  # cells in which real pictures are taken as well
FEW_POSES = 10  # cells in which six poses are tried as well
PLANNED, PAPERS, UNUSED = 15, 6, 50


@dataclass(frozen=True)
class Score:
    """One solver in one cell. Means over all corners and unused poses of the distance in the
    picture, the same across the line of sight, and with an arrival of the arm in it.
    """

    px: float
    mm: float
    with_arrival_px: float
    hand_eye_mm: float
    hand_eye_deg: float


Scores = dict[str, Score | Refused]


@dataclass(frozen=True)
class _Poses:
    """Joint angles (rad): planned, of the paper's Table 2, and unused ones to be judged at."""

    planned: list[Array]
    papers: list[Array]
    unused: list[Array]


def bench_hand_eye(quick: bool = False) -> dict[str, Any]:
    """Ours, OpenCV's closed forms and vision-calibration on the same pictures of `typical` cells.

    15 planned poses over chessboard 2; the solvers say where its corners appear from 50 poses
    of the same kind that none has seen, and the truth there is that of the arm without the
    scatter of its arrivals (`with_arrival_px`: with it). The points are projected with measured
    detection noise; in three cells pictures are rendered as well, and `rendered_over_projected`
    is the ratio of the errors. Rows are means over cells, those of the hand-eye itself root
    mean squares, as is all of the Bayesian bound; `over_bound` is the larger of mm and deg.
    """
    nominal = load_nominal(data_root() / "cell")
    poses = _poses(nominal)
    return _result([_study(nominal, poses, s) for s in range(QUICK_CELLS if quick else CELLS)])


@dataclass(frozen=True)
class _Outcome:
    """What one cell gave; `rendered` holds ours in real pictures, where they were taken."""

    projected: Scores
    rendered: Scores
    bound: Bound
    gauge: Mapping[str, Sequence[str]]


def _study(nominal: Nominal, poses: _Poses, seed: int) -> _Outcome:
    """One cell: pictures, all answers, their scores."""
    cell = _TrueCell(nominal, seed, seed < RENDERED)
    try:
        taken = cell.taken(poses.planned)
        answers = solve_all(taken)
        if seed < FEW_POSES:
            answers[f"{OURS}, {PAPERS} planned"] = answer(ours, taken.first(PAPERS))
            papers = cell.taken(poses.papers)
            answers[f"{OURS}, {PAPERS} of Table 2"] = answer(ours, papers)
        seen: dict[str, Solved | Refused] = {}
        if seed < RENDERED:
            seen[OURS] = answer(ours, cell.taken(poses.planned, rendered=True))
        best = answers[OURS]
        return _Outcome(
            projected=cell.scores(answers, poses.unused),
            rendered=cell.scores(seen, poses.unused),
            bound=cell.bound(poses),
            gauge=gauge_freedoms(best) if isinstance(best, Solved) else {},
        )
    finally:
        cell.close()


def _poses(nominal: Nominal) -> _Poses:
    """The plan shrinks the error of the board's corners, seen from poses of a third draw."""
    arm, usable = nominal.arm, CandidateConfig()
    corners = apply(nominal.T_base_tabletarget, nominal.tabletarget.corners)
    looks = candidates(nominal, 20, np.random.default_rng(1), usable)
    work = [WorkView(q, corners) for q in looks]
    q_start = hand_eye_start(nominal)
    T_start = arm.fk(q_start)
    return _Poses(
        plan_poses(nominal, PlanningConfig(count=PLANNED), work).qs,
        [arm.ik(T_start * dT, q_start, f"Table 2 {id}") for id, dT in TABLE_2.items()],
        candidates(nominal, UNUSED, np.random.default_rng(2), usable),
    )


class _TrueCell:
    """A drawn cell: what is photographed in it, and the truth to score by."""

    def __init__(self, nominal: Nominal, seed: int, pictures: bool) -> None:
        as_built = draw(nominal, TYPICAL, seed)
        still = Arrival(compliance=as_built.arrival.compliance)
        self._nominal = nominal
        self._world = World(nominal, as_built, pictures)
        self._exact = World(nominal, replace(as_built, arrival=still), pictures=False)
        self._corners = self._world.board_points("tabletarget")

    def close(self) -> None:
        """Free the OpenGL contexts."""
        self._world.close()
        self._exact.close()

    def taken(self, qs: Sequence[Array], rendered: bool = False) -> Taken:
        """Drive to the joint angles (rad), from home, and detect the board in each picture."""
        world, board = self._world, self._nominal.tabletarget
        cell: Cell = SimCell(world) if rendered else PicturelessCell(world)
        detector: Detector = IN_PICTURES
        if not rendered:
            detector = ProjectingDetector(world, measured_noise(TYPICAL))
        world.begin()
        cell.move(hand_eye_start(self._nominal))
        uvs = []
        for number, q in enumerate(qs, start=1):
            cell.move(q)
            uv = detector.chessboard(cell.capture(), board, f"picture {number}")
            uvs.append(self._read(uv, q))
        return Taken(self._nominal, tuple(qs), tuple(uvs))

    def _read(self, uv_px: Array, q: Array) -> Array:
        """The corners in the reading that is nearer to the design: the same for all solvers."""
        nominal = self._nominal
        T_base_camera = nominal.arm.fk(q) * nominal.T_flange_camera
        T = T_base_camera.actInv(nominal.T_base_tabletarget)
        expected = nominal.cameras["hand"].project(nominal.tabletarget.corners, T)
        return min((uv_px, half_turn(uv_px)), key=lambda uv: float(np.linalg.norm(uv - expected)))

    def bound(self, poses: _Poses) -> Bound:
        """What could be known of this cell from the planned pictures."""
        return bayesian_bound(self._exact, TYPICAL, poses.planned, poses.unused)

    def scores(self, answers: Mapping[str, Solved | Refused], unused: Sequence[Array]) -> Scores:
        """All answers at the unused poses; what was refused stays so."""
        self._world.begin()
        exact = [_seen(self._exact, self._corners, q) for q in unused]
        arrived = [_seen(self._world, self._corners, q) for q in unused]
        return {
            name: self._score(answer, unused, exact, arrived)
            if isinstance(answer, Solved)
            else answer
            for name, answer in answers.items()
        }

    def _score(
        self, answer: Solved, unused: Sequence[Array], exact: Sequence["_Sight"],
        arrived: Sequence["_Sight"],
    ) -> Score:  # fmt: skip
        corners = self._nominal.tabletarget.corners
        predicted = np.array([answer.predict(q, corners) for q in unused])
        off = np.linalg.norm(predicted - [s.uv_px for s in exact], axis=2)
        off_arrived = np.linalg.norm(predicted - [s.uv_px for s in arrived], axis=2)
        truth: SE3 = self._world.geometry.T_flange_camera
        return Score(
            px=float(off.mean()),
            mm=float((off * [s.mm_per_px for s in exact]).mean()),
            with_arrival_px=float(off_arrived.mean()),
            hand_eye_mm=distance_mm(answer.T_flange_camera, truth),
            hand_eye_deg=distance_deg(answer.T_flange_camera, truth),
        )


@dataclass(frozen=True)
class _Sight:
    """Where corners really appear (N, 2), and how long a pixel is there (N,)."""

    uv_px: Array
    mm_per_px: Array


def _seen(world: World, corners: Array, q: Array) -> _Sight:
    world.arrive(q)
    truth = world.truth()
    points = apply(truth.T_base_camera.actInv(world.geometry.T_base_tabletarget), corners)
    return _Sight(truth.camera.project(points), 1e3 * points[:, 2] / truth.camera.focal_px)


# -- What comes out ----------------------------------------------------------------------------


def _result(outcomes: Sequence[_Outcome]) -> dict[str, Any]:
    names = list(outcomes[0].projected)
    rows = [_row(name, [o.projected[name] for o in outcomes if name in o.projected])
            for name in names]  # fmt: skip
    if not strongest_is_here():
        rows.append(_empty(STRONGEST, "not installed: pip install 'aoicell[bench]'"))
    both = [o for o in outcomes if o.rendered]
    check = _row(f"{OURS}, rendered", [o.rendered[OURS] for o in both])
    same = _row(f"{OURS}, the same cells projected", [o.projected[OURS] for o in both])
    best, floor = rows[0], _bound_row([o.bound for o in outcomes])
    gauge = next((o.gauge for o in outcomes if o.gauge), {})
    untold = [f"{', '.join(terms)} with {pose}" for pose, terms in gauge.items()]
    best["note"] = "; ".join([*untold, *filter(None, [best["note"]])])
    closed = [row["px"] for row in rows if row["solver"] in closed_form_names() and row["px"]]
    ratios = {
        "best_opencv_over_ours": min(closed) / best["px"],
        "ours_px": best["px"],
        "ours_mm": best["mm"],
        "over_bound": max(best[key] / floor[key] for key in ("hand_eye_mm", "hand_eye_deg")),
        "rendered_over_projected": check["px"] / same["px"],
    }
    return {
        "name": "hand_eye",
        "rows": [*rows, floor, check, same],
        "ratios": {name: round(value, 4) for name, value in ratios.items()},
    }


def _row(name: str, scores: Sequence[Score | Refused]) -> dict[str, Any]:
    solved = [s for s in scores if isinstance(s, Score)]
    refusals = [str(s) for s in scores if isinstance(s, Refused)]
    row = _empty(name, refusals[0] if refusals else "")
    row |= {"cells": len(solved), "refused": len(refusals)}
    if solved:
        row |= {
            key: round(fmean(getattr(s, key) for s in solved), 4)
            for key in ("px", "mm", "with_arrival_px")
        }
        row |= {
            key: round(_rms([getattr(s, key) for s in solved]), 4)
            for key in ("hand_eye_mm", "hand_eye_deg")
        }
    return row


def _empty(name: str, note: str) -> dict[str, Any]:
    return {
        "solver": name, "cells": 0, "refused": 0, "px": None, "mm": None,
        "with_arrival_px": None, "hand_eye_mm": None, "hand_eye_deg": None, "note": note,
    }  # fmt: skip


def _bound_row(bounds: Sequence[Bound]) -> dict[str, Any]:
    figures = {
        key: round(_rms([getattr(b, key) for b in bounds]), 4)
        for key in ("px", "mm", "hand_eye_mm", "hand_eye_deg")
    }
    row = _empty("Bayesian bound", "root mean squares, also of px and mm")
    return row | {"cells": len(bounds)} | figures


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
