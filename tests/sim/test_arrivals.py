"""How the drawn arm stops: each knob's sign, unit and spread, and that none touches another."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.sim.arrivals import Arrivals
from aoicell.sim.drawing import draw
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.transforms import Array

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]

KNOBS = {
    "repeatability": {"repeatability_mm": 0.1},
    "backlash": {"backlash_deg": 0.2},
    "compliance": {"compliance_deg_per_kNm": 0.5},
    "settle": {"settle_mm": 2.0, "settle_ms": 40.0, "wait_ms": 50.0, "lag_ms": 20.0},
}


def gravity(q: Array) -> Array:
    return 100 * np.cos(q)


def arrivals(nominal: Nominal, torques: Callable[[Array], Array] = gravity, /, **knobs: float
             ) -> Arrivals:  # fmt: skip
    """The arm of a drawn cell in which only these knobs are on."""
    arrival = draw(nominal, Tolerances(**knobs), seed=0).arrival
    return Arrivals(nominal.arm, np.zeros(nominal.arm.dof), arrival, torques)


def stopped(arm: Arrivals, *commands: Array) -> Array:
    """True joint angles at the picture after the last of some commands."""
    for index, q in enumerate(commands):
        arm.arrive(q, np.random.default_rng(index))
    return arm.at_picture()


def test_without_knobs_the_arm_stands_where_it_is_told(nominal: Nominal) -> None:
    offsets = np.linspace(-0.01, 0.01, 6)
    arm = Arrivals(nominal.arm, offsets, draw(nominal, Tolerances(), 0).arrival, gravity)
    q = nominal.q_home
    for command in (q, q + 0.1, q - 0.1):
        np.testing.assert_array_equal(stopped(arm, command), command + offsets)
        np.testing.assert_array_equal(arm.rates_at_picture(), 0)


@pytest.mark.parametrize("on", KNOBS)
def test_a_knob_touches_no_other(nominal: Nominal, on: str) -> None:
    """All knobs without this one, and this one alone, add up to all of them."""
    q = nominal.q_home
    commands = (q, q + 0.1, q + 0.03)

    def error(names: set[str]) -> Array:
        knobs = {key: value for name in names for key, value in KNOBS[name].items()}
        return stopped(arrivals(nominal, **knobs), *commands) - commands[-1]

    others = set(KNOBS) - {on}
    assert np.abs(error({on})).max() > 1e-6
    np.testing.assert_allclose(error({on}) + error(others), error(set(KNOBS)), atol=1e-14)


def test_every_arrival_draws_alike(nominal: Nominal) -> None:
    """What is left of a random stream does not depend on the knobs."""
    left = []
    for knobs in ({}, {key: value for knob in KNOBS.values() for key, value in knob.items()}):
        rng = np.random.default_rng(1)
        arrivals(nominal, **knobs).arrive(nominal.q_home, rng)
        left.append(rng.random())
    assert left[0] == left[1]


def again(arm: Arrivals, q: Array, index: int) -> Array:
    """True joint angles after one of many arrivals at the same command."""
    arm.arrive(q, np.random.default_rng([7, index]))
    return arm.at_picture()


# ---- repeatability -----------------------------------------------------------------------------


@pytest.mark.parametrize("pose", ["start", "P_check", "V2", "setup"])
def test_repeatability_is_that_of_iso_9283(
    nominal: Nominal, taught_poses: TaughtPoses, pose: str
) -> None:
    """RP: mean distance from the barycentre, plus three standard deviations of the distance."""
    arm, q = arrivals(nominal, repeatability_mm=0.06), taught_poses(nominal)[pose]
    points = [nominal.arm.fk(again(arm, q, index)).translation for index in range(400)]
    distances_mm = np.linalg.norm(points - np.mean(points, axis=0), axis=1) * 1e3
    assert distances_mm.mean() + 3 * distances_mm.std(ddof=1) == pytest.approx(0.06, rel=0.1)


def test_the_spread_is_that_of_the_knob(nominal: Nominal) -> None:
    """Per axis RP / 3.6 on average, and alike in all joints."""
    arm, q = arrivals(nominal, repeatability_mm=0.36), nominal.q_home
    errors = np.array([again(arm, q, index) for index in range(2000)]) - q
    J = nominal.arm.jacobian(q)[:3]
    variance_mm2 = ((errors @ J.T * 1e3) ** 2).mean()
    assert variance_mm2 == pytest.approx(0.1**2, rel=0.1)
    np.testing.assert_allclose(errors.std(axis=0), errors.std(), rtol=0.1)
    assert np.abs(errors.mean(axis=0)).max() < 4 * errors.std() / np.sqrt(2000)
    correlation = np.corrcoef(errors.T) - np.eye(6)
    assert np.abs(correlation).max() < 0.1


# ---- backlash ----------------------------------------------------------------------------------

HALF = np.radians(0.1)  # of a play of 0.2 deg


def test_a_joint_stops_half_its_play_short(nominal: Nominal) -> None:
    q, way = nominal.q_home, np.array([1, -1, 0.5, -0.5, 0, 0.1])
    arm = arrivals(nominal, backlash_deg=0.2)
    np.testing.assert_allclose(stopped(arm, q - way, q), q - HALF * np.sign(way), atol=1e-12)
    np.testing.assert_allclose(stopped(arm, q + way, q), q + HALF * np.sign(way), atol=1e-12)


def test_a_joint_that_does_not_move_stays_on_its_side(nominal: Nominal) -> None:
    q, first = nominal.q_home, np.array([0.5, 0, 0, 0, 0, 0])
    arm = arrivals(nominal, backlash_deg=0.2)
    error = stopped(arm, q, q + 0.5, q + 0.5, q + 0.5 - first) - (q + 0.5 - first)
    np.testing.assert_allclose(error, np.array([1, -1, -1, -1, -1, -1]) * HALF, atol=1e-12)


def test_a_motion_within_the_play_moves_nothing(nominal: Nominal) -> None:
    q = nominal.q_home
    arm = arrivals(nominal, backlash_deg=0.2)
    before = stopped(arm, q - 0.5, q)
    np.testing.assert_allclose(stopped(arm, q - HALF), before, atol=1e-12)
    np.testing.assert_allclose(stopped(arm, q - 3 * HALF), q - 2 * HALF, atol=1e-12)


# ---- compliance --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def soft_world(nominal: Nominal) -> World:
    return World(nominal, draw(nominal, Tolerances(compliance_deg_per_kNm=1.0), seed=0))


def heights(world: World) -> tuple[float, float]:
    """Height of the flange (m), and the potential energy of the arm (J)."""
    masses, weight = world.model.body_mass, -world.model.opt.gravity[2]
    energy = float(masses @ world.data.xipos[:, 2]) * weight
    return float(world.T_base_body("arm/flange").translation[2]), energy


def test_gravity_pulls_the_flange_down(
    soft_world: World, ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    for name, q in taught_poses(nominal).items():
        soft_world.arrive(q)
        ideal_world.arrive(q)
        (z, energy), (z_stiff, energy_stiff) = heights(soft_world), heights(ideal_world)
        assert energy < energy_stiff, name
        assert 0.1e-3 < z_stiff - z < 20e-3, name


def test_each_joint_gives_way_in_proportion_to_its_torque(
    soft_world: World, ideal_world: World, nominal: Nominal
) -> None:
    """The torque of gravity is what the arm's potential energy falls by with the joint's angle."""
    q, step = nominal.q_home + 0.1, 1e-4
    pull = []
    for turn in step * np.eye(nominal.arm.dof):
        ideal_world.arrive(q + turn)
        _, above = heights(ideal_world)
        ideal_world.arrive(q - turn)
        pull.append((heights(ideal_world)[1] - above) / (2 * step))
    soft_world.arrive(q)
    joints = [soft_world.model.joint(f"arm/{n}").qposadr[0] for n in nominal.arm.joint_names]
    sag_deg = np.degrees(soft_world.data.qpos[joints] - q)
    np.testing.assert_allclose(sag_deg, np.array(pull) / 1e3, atol=1e-5)
    assert np.abs(sag_deg).max() > 0.1


# ---- settling and lag --------------------------------------------------------------------------


def flange_error_mm(nominal: Nominal, arm: Arrivals, q: Array) -> Array:
    """Where the flange is, in its own axes at the command."""
    return nominal.arm.fk(q).actInv(nominal.arm.fk(arm.at_picture())).translation * 1e3


MOVE = np.array([0.3, -0.2, 0.1, 0.05, 0.1, 0.2])
TIMES = {"settle_mm": 2.0, "settle_ms": 40.0}


def test_on_arrival_the_flange_is_still_on_its_way(nominal: Nominal) -> None:
    q, arm = nominal.q_home, arrivals(nominal, **TIMES)
    stopped(arm, q - MOVE, q)
    error_mm, way = flange_error_mm(nominal, arm, q), nominal.arm.jacobian(q)[:3] @ MOVE
    assert np.linalg.norm(error_mm) == pytest.approx(2.0, rel=0.01)
    np.testing.assert_allclose(error_mm / 2, -way / np.linalg.norm(way), atol=0.01)


@pytest.mark.parametrize(
    ("wait_ms", "lag_ms", "seen_ms"), [(60, 0, 60), (60, 20, 40), (0, 0, 0), (10, 30, 0)]
)
def test_it_settles_until_the_instant_of_the_picture(
    nominal: Nominal, wait_ms: float, lag_ms: float, seen_ms: float
) -> None:
    q = nominal.q_home
    arm = arrivals(nominal, **TIMES, wait_ms=wait_ms, lag_ms=lag_ms)
    left = q - stopped(arm, q - MOVE, q)
    fresh = arrivals(nominal, **TIMES)
    expected = (q - stopped(fresh, q - MOVE, q)) * np.exp(-seen_ms / 40)
    np.testing.assert_allclose(left, expected, rtol=1e-9)


def test_rates_are_those_of_the_settling(nominal: Nominal) -> None:
    q, later = nominal.q_home, []
    for wait_ms in (29.99, 30.01):
        later.append(stopped(arrivals(nominal, **TIMES, wait_ms=wait_ms), q - MOVE, q))
    arm = arrivals(nominal, **TIMES, wait_ms=30.0)
    stopped(arm, q - MOVE, q)
    np.testing.assert_allclose(arm.rates_at_picture(), (later[1] - later[0]) / 2e-5, rtol=1e-4)
    assert (np.sign(arm.rates_at_picture()) == np.sign(MOVE)).all(), "it goes on as it came"


def test_without_a_move_there_is_nothing_to_settle(nominal: Nominal) -> None:
    q, arm = nominal.q_home, arrivals(nominal, **TIMES)
    np.testing.assert_array_equal(stopped(arm, q), q)
    np.testing.assert_array_equal(stopped(arm, q - MOVE, q, q), q)
    np.testing.assert_array_equal(arm.rates_at_picture(), 0)


def test_a_small_move_leaves_no_more_than_itself(nominal: Nominal) -> None:
    q, arm = nominal.q_home, arrivals(nominal, **TIMES)
    np.testing.assert_allclose(stopped(arm, q - 1e-5 * MOVE, q), q - 1e-5 * MOVE, atol=1e-15)


def test_a_turn_about_the_flange_settles_at_a_point_beside_it(nominal: Nominal) -> None:
    q, arm = nominal.q_home, arrivals(nominal, **TIMES)
    left = q - stopped(arm, q - np.array([0, 0, 0, 0, 0, 1.0]), q)
    assert left[5] == pytest.approx(2e-3 / 0.1)


# ---- trials ------------------------------------------------------------------------------------


def test_a_restart_forgets_how_the_arm_came(nominal: Nominal) -> None:
    knobs = {"backlash_deg": 0.2, **TIMES, "compliance_deg_per_kNm": 1.0}
    q, found = nominal.q_home, []
    for before in (q + 0.3, q - 0.3):
        arm = arrivals(nominal, **knobs)
        stopped(arm, before, q)
        arm.restart(q)
        np.testing.assert_allclose(arm.at_picture(), q - np.radians(1) * gravity(q) / 1e3)
        found.append(stopped(arm, q + 0.2).tobytes())
    assert found[0] == found[1]
