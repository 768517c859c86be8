"""Moves keep within their limits, take no longer than they must, and run straight."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.robot import Arm
from aoicell.robot.trajectories import MotionLimits, Trajectory, plan
from aoicell.transforms import Array

LIMITS = MotionLimits()


@pytest.fixture(scope="module")
def arm(nominal: Nominal) -> Arm:
    return nominal.arm


def targets(arm: Arm, rng: np.random.Generator) -> list[tuple[Array, Array]]:
    """Moves of all lengths, some with joints at rest."""
    qs = rng.uniform(arm.lower, arm.upper, (8, arm.dof))
    moves = [(q, q + share * (qs[0] - q)) for q in qs[1:] for share in (1e-4, 0.03, 0.3, 1)]
    alone = qs[0] * (np.arange(arm.dof) == 3)
    return [*moves, (qs[0], qs[0] - alone)]


def sampled(move: Trajectory, dt: float) -> Array:
    return np.array([move.sample(t) for t in np.arange(0, move.duration + dt, dt)])


def test_speed_limits_are_those_of_the_urdf(arm: Arm) -> None:
    limits = [
        j.find("limit") for j in ET.parse(arm.urdf).iter("joint") if j.find("axis") is not None
    ]
    speeds = [float(limit.get("velocity", "nan")) for limit in limits if limit is not None]
    np.testing.assert_allclose(arm.velocity_limits, speeds)
    np.testing.assert_allclose(np.degrees(speeds), [192, 206, 219, 450, 450, 720], atol=0.1)


def test_speed_acceleration_and_jerk_keep_within_limits(arm: Arm, rng: np.random.Generator) -> None:
    dt, speed = 1e-3, arm.velocity_limits
    bounds = (speed, speed / 0.3, speed / 0.3 / 0.1)
    reached = np.zeros(3)
    for start, end in targets(arm, rng):
        rows = sampled(plan(arm, start, end), dt)
        for order, bound in enumerate(bounds):
            rows = np.diff(rows, axis=0) / dt
            reached[order] = max(reached[order], (np.abs(rows) / bound).max(initial=0))
    assert (reached < 1 + 1e-5).all()
    assert (reached > 0.99).all(), "time-optimal: each limit is reached"


def test_a_move_begins_and_ends_at_rest(arm: Arm, rng: np.random.Generator) -> None:
    for start, end in targets(arm, rng):
        move, dt = plan(arm, start, end), 1e-4
        np.testing.assert_allclose(move.sample(0), start, atol=1e-12)
        np.testing.assert_allclose(move.sample(move.duration), end, atol=1e-12)
        for first, second in ((0, dt), (move.duration - dt, move.duration)):
            assert np.abs(move.sample(second) - move.sample(first)).max() < 1e-8
        np.testing.assert_array_equal(move.sample(-1), move.sample(0))
        np.testing.assert_array_equal(move.sample(99), move.sample(move.duration))


def test_it_is_symmetric_in_time_and_direction(arm: Arm, rng: np.random.Generator) -> None:
    for start, end in targets(arm, rng):
        there, back = plan(arm, start, end), plan(arm, end, start)
        assert back.duration == pytest.approx(there.duration, abs=1e-9)
        for share in (0.1, 0.25, 0.5, 0.8):
            t = share * there.duration
            mirrored = there.sample(there.duration - t)
            np.testing.assert_allclose(there.sample(t) + mirrored, start + end, atol=1e-8)
            np.testing.assert_allclose(back.sample(t), mirrored, atol=1e-8)


def test_all_joints_move_in_proportion(arm: Arm, rng: np.random.Generator) -> None:
    for start, end in targets(arm, rng):
        move, way = plan(arm, start, end), end - start
        for share in (0.1, 0.4, 0.7):
            done = move.sample(share * move.duration) - start
            along = (done @ way) / (way @ way)
            assert 0 < along < 1
            np.testing.assert_allclose(done, along * way, atol=1e-8)


def test_a_long_move_takes_what_the_slowest_joint_needs(arm: Arm) -> None:
    """Distance over speed, and the time to reach the speed and the acceleration once each."""
    start, end = np.zeros(6), np.array([1.5, 1.6, 0.1, 0.2, 0.3, 0.4])
    expected = max(np.abs(end) / arm.velocity_limits) + 0.3 + 0.1
    assert plan(arm, start, end).duration == pytest.approx(expected, rel=1e-6)
    half = replace(LIMITS, speed_share=0.5)
    expected = 2 * max(np.abs(end) / arm.velocity_limits) + 0.15 + 0.1
    assert plan(arm, start, end, half).duration == pytest.approx(expected, rel=1e-6)


def test_no_way_takes_no_time(arm: Arm, nominal: Nominal) -> None:
    move = plan(arm, nominal.q_home, nominal.q_home)
    assert move.duration == 0
    np.testing.assert_array_equal(move.path(0.1), [nominal.q_home])
    np.testing.assert_array_equal(move.sample(0), nominal.q_home)


def test_the_path_leaves_no_gap(arm: Arm, rng: np.random.Generator) -> None:
    step = np.radians(5)
    for start, end in targets(arm, rng):
        path = plan(arm, start, end).path(step)
        np.testing.assert_allclose(path[[0, -1]], [start, end], atol=1e-12)
        longest = np.abs(np.diff(path, axis=0)).max()
        assert longest <= step + 1e-12
        assert len(path) - 2 < np.abs(end - start).max() / step


@pytest.mark.parametrize("field", ["speed_share", "time_to_speed", "time_to_acceleration"])
@pytest.mark.parametrize("value", [0.0, -0.1, float("nan"), 11.0])
def test_limits_that_make_no_sense_are_refused(field: str, value: float) -> None:
    with pytest.raises(InputError, match=field):
        replace(LIMITS, **{field: value})


def test_a_target_that_is_no_number_is_refused(arm: Arm) -> None:
    with pytest.raises(InputError, match="no trajectory"):
        plan(arm, np.zeros(6), np.full(6, np.nan))
