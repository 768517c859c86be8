"""Even boards are read the right way round by the arm's motion, whatever the pictures say."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.recorded import Conditions, draw_recording

from aoicell.calibration.half_turns import half_turn_of, settle_half_turns
from aoicell.calibration.problem import Problem, Sight
from aoicell.calibration.starts import sight_poses
from aoicell.transforms import apply


def flipped(problem: Problem, flips: dict[tuple[int, str, str], bool]) -> Problem:
    """As a detector reports it that starts at the other end of the board."""
    views = []
    for v, view in enumerate(problem.views):
        sights = []
        for sight in view.sights:
            assert isinstance(sight, Sight)
            turn = flips.get((v, sight.eye, sight.fixture), False)
            sights.append(replace(sight, uv_px=sight.uv_px[::-1]) if turn else sight)
        views.append(replace(view, sights=tuple(sights)))
    return problem.with_views(views)


def same_reading(settled: Problem, truth: Problem) -> list[dict[tuple[str, str], bool]]:
    """By view and sight: whether each point has the pixel that it has in truth."""
    found = []
    for view, true_view in zip(settled.views, truth.views, strict=True):
        alike = {}
        for sight, true_sight in zip(view.sights, true_view.sights, strict=True):
            assert isinstance(sight, Sight)
            assert isinstance(true_sight, Sight)
            order = np.argsort(sight.ids)
            alike[sight.eye, sight.fixture] = bool(
                np.allclose(sight.uv_px[order], true_sight.uv_px)
            )
        found.append(alike)
    return found


@pytest.mark.parametrize("seed", range(3))
def test_readings_agree_over_the_views(seed: int) -> None:
    rng = np.random.default_rng(seed)
    conditions = Conditions(views=10, half_turns=True, roll_deg=100, repeat_mm=0.02)
    truth = draw_recording(seed, conditions).problem
    flips = {(v, "hand", "tabletarget"): bool(rng.random() < 0.5) for v in range(10)}
    posed = sight_poses(flipped(truth, flips))
    readings = settle_half_turns(posed.problem, posed.poses)
    alike = [a["hand", "tabletarget"] for a in same_reading(readings.problem, truth)]
    assert len(set(alike)) == 1
    assert alike[0] == (not flips[0, "hand", "tabletarget"])  # named by the first view
    assert not readings.unsettled
    turned = {f"v{v:02d}" for (v, _, _), flip in flips.items() if flip != flips[
        0, "hand", "tabletarget"]}  # fmt: skip
    assert set(readings.turned) == turned


def test_two_eyes_agree_on_the_board_that_both_see() -> None:
    conditions = Conditions(views=14, half_turns=True, boards=("hand", "tripod"))
    truth = draw_recording(0, conditions).problem
    flips = {(v, "tripod", "tabletarget"): True for v in range(14)}
    posed = sight_poses(flipped(truth, flips))
    readings = settle_half_turns(posed.problem, posed.poses)
    for alike in same_reading(readings.problem, truth):
        both = {value for (_, fixture), value in alike.items() if fixture == "tabletarget"}
        assert len(both) == 1


def test_the_half_turn_maps_the_print_to_itself() -> None:
    fixture = draw_recording(0, Conditions(views=1)).problem.fixtures[0]
    shifted = replace(fixture, points=fixture.points + np.array([0.1, -0.2, 0]))
    for f in (fixture, shifted):
        np.testing.assert_allclose(apply(half_turn_of(f), f.points), f.points[::-1], atol=1e-12)
