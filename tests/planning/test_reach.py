"""What the arm can take up, against the poses it must reach and MuJoCo's account of contacts."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aoicell.errors import Unreachable
from aoicell.nominal import Nominal, View
from aoicell.planning.reach import Reach, ReachConfig
from aoicell.robot.collision import Solid
from aoicell.sim.world import World
from aoicell.transforms import distance_deg, distance_mm, rotation, translation

VIEW = View("V", 0.45, (0.1, -0.1), 0.2, (0.05, 0.03, 0.0))


@pytest.fixture(scope="module")
def reach(nominal: Nominal) -> Reach:
    return Reach(nominal)


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


views = st.builds(
    View,
    id=st.just("drawn"),
    distance=floats(0.2, 0.7),
    tilt=st.tuples(floats(-0.6, 0.6), floats(-0.6, 0.6)),
    roll=floats(-np.pi, np.pi),
    aim=st.tuples(floats(-0.21, 0.21), floats(-0.165, 0.165), st.just(0.0)),
)


@given(view=views)
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_reached_is_the_view_and_keeps_off_trouble(
    nominal: Nominal, reach: Reach, ideal_world: World, view: View
) -> None:
    try:
        q = reach.of(view).q
    except Unreachable:
        return
    T_base_camera = nominal.arm.fk(q) * nominal.T_flange_camera
    wanted = nominal.T_base_board * view.T_target_camera
    assert distance_mm(T_base_camera, wanted) < 1e-4
    assert distance_deg(T_base_camera, wanted) < 1e-5
    assert nominal.arm.limit_margin(q) >= np.radians(10)
    assert nominal.arm.singularity_margin(q) >= 0.08
    assert np.sign(q[4]) == np.sign(nominal.q_home[4]), "the wrist bends the same way"
    ideal_world.arrive(q)
    assert ideal_world.contacts() == []


def test_most_views_from_above_are_reached(reach: Reach, rng: np.random.Generator) -> None:
    def drawn(roll: float) -> View:
        x, y = rng.uniform([-0.2, -0.15], [0.2, 0.15])
        return View("drawn", rng.uniform(0.35, 0.6), (0.1, 0.1), roll, (x, y, 0.0))

    reached = [reach.reaches(drawn(roll)) for roll in np.linspace(-np.pi, np.pi, 60)]
    assert sum(reached) > 50  # but for rolls at the limit of the last joint


def test_the_taught_views_are_reached_with_their_margins(reach: Reach, nominal: Nominal) -> None:
    for view in nominal.inspection_views:
        reached = reach.of(view)
        assert reached.view is view
        assert reached.limit_margin == pytest.approx(nominal.arm.limit_margin(reached.q))
        assert reached.singularity_margin == nominal.arm.singularity_margin(reached.q)


@pytest.mark.parametrize("turns", [-1, 1])
def test_a_whole_turn_changes_nothing(reach: Reach, turns: int) -> None:
    turned = replace(VIEW, roll=VIEW.roll + turns * 2 * np.pi)
    np.testing.assert_allclose(reach.of(turned).q, reach.of(VIEW).q, atol=1e-8)


def test_another_branch_is_not_taken_where_a_leap_lands_on_it(
    nominal: Nominal, reach: Reach
) -> None:
    view = View("v", 0.4008, (-0.24415, -0.03467), 1.86186, (-0.10236, -0.13439, 0.0))
    T = nominal.T_base_board * view.T_target_camera * nominal.T_flange_camera.inverse()
    q = reach.of(view).q
    assert q[4] < 0
    assert nominal.arm.ik(T, nominal.q_home)[4] > 0, "the leap from home"


def test_the_views_follow_the_board(nominal: Nominal) -> None:
    T = nominal.T_base_board * translation(0.05, -0.04) * rotation("z", 0.3)
    q = Reach(nominal, T).of(VIEW).q
    T_base_camera = nominal.arm.fk(q) * nominal.T_flange_camera
    assert distance_mm(T.actInv(T_base_camera), VIEW.T_target_camera) < 1e-4


# -- Refusals say what is wrong ----------------------------------------------------


def refusal(reach: Reach, view: View, points: object = None) -> str:
    assert not reach.reaches(view) or points is not None
    with pytest.raises(Unreachable) as caught:
        reach.of(view, points)  # type: ignore[arg-type]
    message = str(caught.value)
    assert message.startswith(f"{view.id}: ")
    assert "\n" not in message
    return message


def test_a_joint_near_its_limit_is_named(nominal: Nominal, reach: Reach) -> None:
    q, arm = reach.of(VIEW).q, nominal.arm
    margins = np.degrees(np.minimum(q - arm.lower, arm.upper - q))
    nearest = int(margins.argmin())
    strict = Reach(nominal, config=ReachConfig(limit_deg=float(margins.min()) + 1))
    message = refusal(strict, VIEW)
    assert f"{arm.joint_names[nearest]} would stand at {np.degrees(q[nearest]):.1f} deg" in message
    assert f"{margins.min():.1f} deg from its limit" in message


def test_a_nearly_singular_posture(nominal: Nominal, reach: Reach) -> None:
    margin = reach.of(VIEW).singularity_margin
    assert Reach(nominal, config=ReachConfig(singularity=margin - 1e-6)).reaches(VIEW)
    strict = Reach(nominal, config=ReachConfig(singularity=margin + 1e-6))
    assert f"nearly singular ({margin:.3f}" in refusal(strict, VIEW)


def test_a_camera_in_the_board(reach: Reach) -> None:
    message = refusal(reach, replace(VIEW, distance=0.04))
    assert re.search(r"hand \d would come closer than 20 mm to (server board|table)", message)


def test_a_board_beyond_the_arm(nominal: Nominal) -> None:
    far = translation(0, 1.2, 0) * nominal.T_base_board
    assert "out of reach" in refusal(Reach(nominal, far), VIEW)


def test_what_stands_in_the_line_of_sight(nominal: Nominal, reach: Reach) -> None:
    T_base_camera = nominal.T_base_board * VIEW.T_target_camera
    sign = Solid("sign", (0.02, 0.02, 0.002), T_base_camera * translation(z=0.2))
    message = refusal(Reach(nominal, obstacles=[sign]), VIEW)
    assert "sign would stand between the camera and what it looks at" in message
    beside = replace(sign, T_mount_solid=T_base_camera * translation(0.03, 0, 0.2))
    assert Reach(nominal, obstacles=[beside]).reaches(VIEW)


def test_what_must_be_shown_stays_in_the_picture(nominal: Nominal, reach: Reach) -> None:
    half = 0.45 * 800 / 2667  # of what a frontal picture at 0.45 m covers along the board's x
    view = View("V", 0.45)
    inside, at_edge = [[half - 0.006, 0, 0]], [[half - 0.004, 0, 0]]  # 30 px are 5.1 mm
    reach.of(view, inside)
    assert "30 px inside the picture" in refusal(reach, view, at_edge)


def test_the_room_for_the_cables_is_kept(nominal: Nominal, reach: Reach) -> None:
    q = nominal.q_home.copy()
    pairs = set()
    for q[4] in np.radians(np.arange(-125, -60, 2.5)):
        for q[5] in np.radians(np.arange(-170, 171, 20)):
            pairs.add(reach.cell.touching(q))
    assert any(pair and "camera cables" in pair for pair in pairs)
