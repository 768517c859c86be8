"""The corrected poses: the paper's equations, the product of poses, and what they do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aoicell.correction import (
    Correction,
    correct,
    corrected_views,
    motion_by_equations,
    motion_by_poses,
)
from aoicell.nominal import Nominal
from aoicell.observation import Observation, RobotState
from aoicell.pipeline import flange_target
from aoicell.registration import TaughtView, Template
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.layout import LocatedLayout
from aoicell.targets.pose import TargetPose
from aoicell.transforms import (
    SE3,
    apply,
    distance_deg,
    distance_mm,
    from_rvec,
    from_xyz_rpy,
    rotation,
    translation,
)

lengths, angles = st.floats(-2, 2), st.floats(-1.8, 1.8)
poses = st.builds(
    lambda x, y, z, a, b, c: from_rvec([a, b, c], [x, y, z]), *[lengths] * 3, *[angles] * 3
)
points = st.tuples(lengths, lengths, lengths)


@settings(max_examples=300)
@given(T_S=poses, T_N=poses, T_base_camera=poses)
def test_the_equations_are_the_product_of_poses(T_S: SE3, T_N: SE3, T_base_camera: SE3) -> None:
    by_equations = motion_by_equations(T_S, T_N, T_base_camera)
    by_poses = motion_by_poses(T_base_camera * T_S, T_base_camera * T_N)
    np.testing.assert_allclose(by_equations.homogeneous, by_poses.homogeneous, atol=1e-9)


@settings(max_examples=100)
@given(T_S=poses, T_N=poses, T_base_camera=poses, p_board=points)
def test_points_of_the_board_are_carried_along(
    T_S: SE3, T_N: SE3, T_base_camera: SE3, p_board: tuple[float, float, float]
) -> None:
    p_taught = apply(T_base_camera * T_S, p_board)
    p_now = apply(T_base_camera * T_N, p_board)
    motion = motion_by_equations(T_S, T_N, T_base_camera)
    np.testing.assert_allclose(motion.act(p_taught), p_now, atol=1e-9)


def test_the_rotation_and_the_shift_are_in_the_bases_axes() -> None:
    """The marker lies turned by 90 deg: its own axes would send the arm the wrong way."""
    T_base_camera = from_xyz_rpy([0.3, 0.8, 0.9], [np.pi, 0, 0.2])
    T_base_marker = from_xyz_rpy([0.25, 0.75, 0.41], [0, 0, np.pi / 2])
    centre = T_base_marker.translation
    known = translation(0.05) * translation(*centre) * rotation("x", 0.2) * translation(*-centre)
    T_S, T_N = T_base_camera.actInv(T_base_marker), T_base_camera.actInv(known * T_base_marker)
    motion = motion_by_equations(T_S, T_N, T_base_camera)
    np.testing.assert_allclose(motion.homogeneous, known.homogeneous, atol=1e-12)
    # what comes out when T_D is applied as it is, or inverted, is far away
    T_D = T_N.inverse() * T_S
    for wrong in (T_D, T_D.inverse()):
        about = translation(*(centre + wrong.translation)) * SE3(wrong.rotation, np.zeros(3))
        assert distance_mm(about * translation(*-centre), known) > 30


# -- Whole corrections --------------------------------------------------------------------------

X = from_xyz_rpy([0.009, -0.001, 0.052], [0.01, -0.02, 0.015])  # T_flange_camera


def located(T_camera_target: SE3) -> LocatedLayout:
    return LocatedLayout(TargetPose(T_camera_target, 0.0, np.eye(6), 0.05), {})


@pytest.fixture(scope="module")
def template(nominal: Nominal) -> Template:
    """The shipped views and P_check, with a camera that sits a little askew."""

    def seen(q: np.ndarray) -> Observation:
        return Observation(np.zeros((2, 2), np.uint8), RobotState(q, nominal.arm.fk(q)))

    T_base_marker = nominal.T_base_board * nominal.T_board_positioning
    look = seen(flange_target(nominal, T_base_marker, nominal.check, nominal.q_home))
    views = tuple(
        TaughtView(v.id, seen(flange_target(nominal, nominal.T_base_board, v, look.state.q)))
        for v in nominal.inspection_views
    )
    T_S = (look.state.T_base_flange * X).actInv(T_base_marker)
    return Template({"M1": CrossMarker().crosses}, look, located(T_S), views)


def displaced(nominal: Nominal, shift_mm: float, turn_deg: float) -> SE3:
    """T_base_motion about the positioning marker."""
    centre = (nominal.T_base_board * nominal.T_board_positioning).translation
    there = centre + np.array([0.6, -0.8, 0]) * shift_mm / 1e3
    return translation(*there) * rotation("z", np.radians(turn_deg)) * translation(*-centre)


def run(nominal: Nominal, template: Template, motion: SE3, by_equations: bool) -> Correction:
    T_base_camera = template.look.state.T_base_flange * X
    T_base_marker = nominal.T_base_board * nominal.T_board_positioning
    T_N = T_base_camera.actInv(motion * T_base_marker)
    return correct(template, located(T_N), T_base_camera, T_base_camera, nominal.arm, by_equations)


@pytest.mark.parametrize("by_equations", [True, False])
@pytest.mark.parametrize(("mm", "deg"), [(0, 0), (60, 15), (60, -15), (49.1, 7)])
def test_the_camera_sees_the_board_as_it_was_taught(
    nominal: Nominal, template: Template, mm: float, deg: float, by_equations: bool
) -> None:
    motion = displaced(nominal, mm, deg)
    result = run(nominal, template, motion, by_equations)
    np.testing.assert_allclose(result.T_base_motion.homogeneous, motion.homogeneous, atol=1e-9)
    assert [view.id for view in result.views] == [view.id for view in template.views]
    for view, taught in zip(result.views, template.views, strict=True):
        before = (taught.standard.state.T_base_flange * X).actInv(nominal.T_base_board)
        after = (nominal.arm.fk(view.q) * X).actInv(motion * nominal.T_base_board)
        assert distance_mm(before, after) < 1e-4
        assert distance_deg(before, after) < 1e-4
        assert distance_mm(view.T_base_flange, nominal.arm.fk(view.q)) < 1e-4


@pytest.mark.parametrize("by_equations", [True, False])
def test_the_motion_is_stated_in_millimetres_and_degrees(
    nominal: Nominal, template: Template, by_equations: bool
) -> None:
    result = run(nominal, template, displaced(nominal, 50, -12), by_equations)
    assert result.shift_mm == pytest.approx(50, abs=1e-6)
    assert result.turn_deg == pytest.approx(12, abs=1e-6)


def test_the_look_need_not_be_from_the_taught_pose(nominal: Nominal, template: Template) -> None:
    motion = displaced(nominal, 40, 10)
    T_then = template.look.state.T_base_flange * X
    T_now = translation(0.01, -0.02, 0.03) * T_then * rotation("y", 0.1)
    T_base_marker = nominal.T_base_board * nominal.T_board_positioning
    now = located(T_now.actInv(motion * T_base_marker))
    result = correct(template, now, T_then, T_now, nominal.arm)
    np.testing.assert_allclose(result.T_base_motion.homogeneous, motion.homogeneous, atol=1e-9)


@given(mm=st.floats(0, 60), deg=st.floats(-15, 15))
def test_the_arm_stays_on_the_taught_branch(
    nominal: Nominal, template: Template, mm: float, deg: float
) -> None:
    motion = displaced(nominal, mm, deg)
    for view, taught in zip(
        corrected_views(template, motion, nominal.arm)[0], template.views, strict=True
    ):
        change = np.abs(view.q - taught.standard.state.q)
        assert change.max() < np.radians(25)
        assert (view.q >= nominal.arm.lower).all()
        assert (view.q <= nominal.arm.upper).all()


def test_without_a_displacement_nothing_moves(nominal: Nominal, template: Template) -> None:
    for view, taught in zip(
        corrected_views(template, SE3.Identity(), nominal.arm)[0], template.views, strict=True
    ):
        np.testing.assert_allclose(view.q, taught.standard.state.q, atol=1e-9)


def test_a_view_out_of_reach_is_named_with_the_nearest(
    nominal: Nominal, template: Template
) -> None:
    views, unreached = corrected_views(template, translation(1.5), nominal.arm)
    assert views == ()
    assert [view.id for view in unreached] == [view.id for view in template.views]
    assert unreached[0].reason.startswith("corrected view V1: flange pose at")
    assert "out of reach" in unreached[0].reason
    nearest = unreached[0].q_nearest
    assert nearest is not None
    assert (nearest <= nominal.arm.upper).all()


def test_the_others_go_on_without_a_view_out_of_reach(nominal: Nominal, template: Template) -> None:
    """The farther the board goes, the fewer views are left."""
    left = [
        len(corrected_views(template, translation(y=y / 100), nominal.arm)[0])
        for y in range(0, 80, 4)
    ]
    assert left[0] == len(template.views)
    assert left[-1] == 0
    assert any(0 < count < len(template.views) for count in left)


def test_a_nearly_singular_view_counts_as_out_of_reach(
    nominal: Nominal, template: Template
) -> None:
    _, unreached = corrected_views(template, SE3.Identity(), nominal.arm, min_singularity_margin=10)
    assert all("nearly singular" in view.reason for view in unreached)
    assert len(unreached) == len(template.views)
