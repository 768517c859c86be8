"""The hand-eye benchmark: its solvers, its bound, and the command's promises."""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from aoicell.benchmark.micro import BENCHMARKS, hand_eye
from aoicell.benchmark.micro.hand_eye import _Poses, _poses, _seen, _TrueCell
from aoicell.benchmark.micro.hand_eye_bound import Bound, _DrawnCell, bayesian_bound
from aoicell.benchmark.micro.hand_eye_solvers import (
    OURS,
    STRONGEST,
    Solved,
    answer,
    closed_form_names,
    solve_all,
    strongest_is_here,
)
from aoicell.errors import Implausible, Refused
from aoicell.nominal import Nominal
from aoicell.sim.as_built import Geometry
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array, from_rvec


@pytest.fixture(scope="module")
def poses(nominal: Nominal) -> _Poses:
    every = _poses(nominal)
    return replace(every, unused=every.unused[:8])


@pytest.fixture(scope="module")
def cell(nominal: Nominal) -> Iterator[_TrueCell]:
    cell = _TrueCell(nominal, seed=0, pictures=False)
    yield cell
    cell.close()


@pytest.fixture(scope="module")
def answers(cell: _TrueCell, poses: _Poses) -> dict[str, Solved | Refused]:
    return solve_all(cell.taken(poses.planned))


def test_the_command_prints_what_it_promises(
    monkeypatch: pytest.MonkeyPatch, poses: _Poses, answers: dict[str, Solved | Refused]
) -> None:
    """One cell, the same answer for its rendered pictures: what a test has time for."""
    taken = _TrueCell.taken
    monkeypatch.setattr(_TrueCell, "taken", lambda self, qs, rendered=False: taken(self, qs))
    monkeypatch.setattr(hand_eye, "solve_all", lambda taken: dict(answers))
    monkeypatch.setattr(hand_eye, "answer", lambda solver, taken: answers[OURS])
    monkeypatch.setattr(hand_eye, "_poses", lambda nominal: poses)
    monkeypatch.setattr(hand_eye, "QUICK_CELLS", 1)
    monkeypatch.setattr(hand_eye, "FEW_POSES", 0)
    result = BENCHMARKS["hand_eye"](True)
    assert json.loads(json.dumps(result)) == result
    rows = {row["solver"]: row for row in result["rows"]}
    assert {OURS, STRONGEST, "Bayesian bound", *closed_form_names()} <= set(rows)
    assert len({tuple(row) for row in result["rows"]}) == 1  # one table
    best = rows[OURS]
    closed = min(rows[name]["px"] for name in closed_form_names())
    ratios = result["ratios"]
    assert ratios["ours_px"] == best["px"] < 0.3
    assert ratios["ours_mm"] == best["mm"] < 0.06
    assert ratios["best_opencv_over_ours"] == pytest.approx(closed / best["px"], abs=1e-3)
    assert ratios["best_opencv_over_ours"] > 5
    assert ratios["rendered_over_projected"] == 1
    assert best["with_arrival_px"] > best["px"]
    assert "joint_1 offset" in best["note"].split(" with T_base_tabletarget")[0]
    assert "joint_6 offset" in best["note"].split(" with T_flange_hand")[0]
    assert "the last link" in best["note"]


def test_scores_are_zero_for_who_knows_the_truth(cell: _TrueCell, poses: _Poses) -> None:
    geometry, world = cell._world.geometry, cell._exact

    class Oracle(Solved):
        def predict(self, q: np.ndarray, points: np.ndarray) -> np.ndarray:
            world.arrive(q)
            T = world.truth().T_base_camera.actInv(geometry.T_base_tabletarget)
            return self.camera.project(cell._corners, T)

    off = SE3(np.eye(3), np.array([3e-3, 0, 4e-3])) * from_rvec([0, 0, np.radians(0.5)], [0, 0, 0])
    oracle = Oracle(
        cell._nominal.arm, world.camera("hand"), off * geometry.T_flange_camera,
        geometry.T_base_tabletarget,
    )  # fmt: skip
    score = cell.scores({"oracle": oracle}, poses.unused)["oracle"]
    assert not isinstance(score, Refused)
    assert score.px < 1e-9
    assert score.mm < 1e-9
    assert 0.05 < score.with_arrival_px < 1  # repeatability and play
    assert score.hand_eye_deg == pytest.approx(0.5, abs=1e-6)
    assert score.hand_eye_mm > 4


def test_ours_is_near_the_bound_and_the_closed_forms_are_not(
    cell: _TrueCell, poses: _Poses, answers: dict[str, Solved | Refused]
) -> None:
    assert set(closed_form_names()) < set(answers)
    assert (STRONGEST in answers) == strongest_is_here()
    scores = cell.scores(answers, poses.unused)
    bound = cell.bound(poses)
    best = scores[OURS]
    assert not isinstance(best, Refused)
    assert best.px < 2 * bound.px
    assert best.hand_eye_mm < 3 * bound.hand_eye_mm
    others = [scores[name] for name in closed_form_names()]
    assert all(isinstance(s, Refused) or s.px > 4 * best.px for s in others)


def test_the_bound_is_no_better_than_the_last_link_allows(cell: _TrueCell, poses: _Poses) -> None:
    """The last link and the mount make one product: the share of each rests on the priors."""
    bound = cell.bound(poses)
    link, mount = TYPICAL.link_mm, TYPICAL.mount_mm
    floor = np.sqrt(3) / np.sqrt(1 / link**2 + 1 / mount**2)
    assert floor < bound.hand_eye_mm < np.sqrt(3) * mount
    turn = np.sqrt(3) / np.sqrt(1 / TYPICAL.axis_deg**2 + 1 / TYPICAL.mount_deg**2)
    assert turn < bound.hand_eye_deg < np.sqrt(3) * TYPICAL.mount_deg
    fewer = bayesian_bound(cell._exact, TYPICAL, poses.planned[:5], poses.unused)
    assert fewer.px > 1.2 * bound.px
    assert fewer.hand_eye_mm > bound.hand_eye_mm
    # at 0.35 to 0.65 m and some 2667 px a pixel is 0.13 to 0.24 mm
    assert 0.13 < bound.mm / bound.px < 0.24


SMALL = np.array([1e-4, -2e-4, 3e-4, 1e-4, 2e-4, -3e-4])  # a twist (m, rad)
MOUNT = np.array([TYPICAL.mount_mm / 1e3] * 3 + [np.radians(TYPICAL.mount_deg)] * 3)
LINK = np.array([TYPICAL.link_mm / 1e3] * 3 + [np.radians(TYPICAL.axis_deg)] * 3)
ZERO = np.radians(TYPICAL.joint_zero_deg)


def link_changed(geometry: Geometry, joint: int) -> Geometry:
    corrections = list(geometry.joint_corrections)
    corrections[joint] = corrections[joint] * pin.exp6(SMALL)
    return replace(geometry, joint_corrections=tuple(corrections))


def zero_changed(geometry: Geometry) -> Geometry:
    return replace(geometry, joint_offsets=geometry.joint_offsets + np.eye(6)[2] * 2e-4)


def mount_changed(geometry: Geometry) -> Geometry:
    return replace(geometry, T_flange_camera=geometry.T_flange_camera * pin.exp6(SMALL))


@pytest.mark.parametrize(
    ("change", "first", "x"),
    [
        (mount_changed, 0, SMALL / MOUNT),
        (lambda g: link_changed(g, 0), 6, SMALL / LINK),
        (lambda g: link_changed(g, 3), 24, SMALL / LINK),
        (lambda g: link_changed(g, 6), 42, SMALL / LINK),
        (zero_changed, 50, np.array([2e-4 / ZERO])),
    ],
    ids=["mount", "first link", "fourth link", "last link", "third zero"],
)
def test_the_bounds_derivatives_are_those_of_the_cell(
    nominal: Nominal, cell: _TrueCell, poses: _Poses,
    change: Callable[[Geometry], Geometry], first: int, x: Array,
) -> None:  # fmt: skip
    """Against a cell that is built with the change."""
    q, exact = poses.unused[0], cell._exact
    told = _DrawnCell(exact, TYPICAL).look(q).by_cell[:, first : first + len(x)] @ x
    changed = replace(exact.as_built, geometry=change(exact.geometry))
    other = World(nominal, changed, pictures=False)
    before, after = (_seen(world, cell._corners, q).uv_px.ravel() for world in (exact, other))
    moved = after - before
    assert np.abs(moved).max() > 0.1
    np.testing.assert_allclose(told, moved, atol=0.02 * np.abs(moved).max())


def test_a_refusal_is_no_answer_and_no_crash(nominal: Nominal, cell: _TrueCell) -> None:
    def gives_up(taken: object) -> Solved:
        raise Implausible("no motion")

    refusal = answer(gives_up, cell.taken([]))
    row = hand_eye._row("one", [refusal])
    assert row["refused"] == 1
    assert row["px"] is None
    assert row["note"] == "no motion"


def test_a_missing_solver_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hand_eye, "strongest_is_here", lambda: False)
    one = hand_eye.Score(0.1, 0.02, 0.2, 0.4, 0.05)
    scores = {OURS: one} | {name: replace(one, px=0.7) for name in closed_form_names()}
    outcome = hand_eye._Outcome(scores, {OURS: one}, Bound(0.4, 0.04, 0.1, 0.02), {})
    result = hand_eye._result([outcome, replace(outcome, rendered={})])
    (row,) = [row for row in result["rows"] if row["solver"] == STRONGEST]
    assert row["cells"] == 0
    assert "aoicell[bench]" in row["note"]
    assert result["ratios"]["best_opencv_over_ours"] == 7
    assert result["ratios"]["over_bound"] == 1.25
