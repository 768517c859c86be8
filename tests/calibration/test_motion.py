"""Which motion is missing, in one sentence, before anything is solved."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.recorded import Conditions, draw_recording, spoil

from aoicell.calibration.motion import Motion, examine_motion, unseen
from aoicell.calibration.problem import Problem
from aoicell.calibration.starts import sight_poses


def motion_of(problem: Problem) -> Motion:
    posed = sight_poses(problem)
    (motion,) = examine_motion(posed.problem, posed.poses)
    return motion


def test_a_good_motion_is_measured_and_misses_nothing() -> None:
    motion = motion_of(draw_recording(0).problem)
    assert not motion.missing
    assert not motion.poor
    assert motion.views == 15
    assert motion.turn_deg[0] > motion.turn_deg[1] > 10
    assert motion.range_deg > 25
    assert 10 < motion.tilt_deg < 35
    assert 1.2 < motion.depth_ratio < 1.5


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        ("three views", "3 views are too few"),
        ("one axis", "turns about one axis only"),
        ("translation only", "only translates"),
    ],
)
def test_what_is_missing_is_said(kind: str, sentence: str) -> None:
    rng = np.random.default_rng(1)
    motion = motion_of(spoil(draw_recording(1), kind, rng)())
    (missing,) = motion.missing
    assert sentence in missing
    assert "'tabletarget' in 'hand'" in missing


def test_the_axis_is_named_in_the_flange() -> None:
    recording = draw_recording(1)
    rng = np.random.default_rng(3)
    axis = np.random.default_rng(3).standard_normal(3)
    axis /= np.linalg.norm(axis)
    motion = motion_of(spoil(recording, "one axis", rng)())
    assert abs(motion.axes[0] @ axis) == pytest.approx(1, abs=1e-6)
    assert motion.turn_deg[1] < 1e-6


def test_frontal_views_leave_the_focal_length_open() -> None:
    conditions = Conditions(views=8, tilt_deg=1.0, distances_mm=(500.0, 510.0))
    recording = draw_recording(0, conditions)
    poor = " ".join(motion_of(recording.problem).poor)
    assert "frontal" in poor
    assert "from one distance" in poor
    kept = replace(recording.problem, eyes=(replace(recording.problem.eyes[0], refine=False),))
    assert "frontal" not in " ".join(motion_of(kept).poor)


def test_few_views_and_little_turning_are_poor() -> None:
    motion = motion_of(draw_recording(0, Conditions(views=5)).problem)
    assert any("5 views" in s for s in motion.poor)
    timid = Conditions(views=10, tilt_deg=3.0, roll_deg=30.0)
    assert any("second axis" in s for s in motion_of(draw_recording(0, timid).problem).poor)


def test_what_no_view_is_about_is_named() -> None:
    both = draw_recording(0, Conditions(views=4, boards=("hand", "tripod"))).problem
    assert unseen(both) == []
    hand = [replace(v, sights=tuple(s for s in v.sights if s.eye == "hand")) for v in both.views]
    eye, fixture = unseen(both.with_views(hand))
    assert "'tripod' sees no target in any view" in eye
    assert "no view shows 'armtarget'" in fixture


def test_a_lens_before_which_nothing_moves_cannot_be_told() -> None:
    both = draw_recording(0, Conditions(views=4, boards=("hand", "tripod"))).problem
    table = [
        replace(v, sights=tuple(s for s in v.sights if s.fixture == "tabletarget"))
        for v in both.views
    ]
    standing = replace(both, fixtures=both.fixtures[:1], views=tuple(table))
    (sentence,) = unseen(standing)
    assert "all that 'tripod' sees stands still before it" in sentence
    known = tuple(replace(e, refine=e.name == "hand") for e in both.eyes)
    assert unseen(replace(standing, eyes=known)) == []
