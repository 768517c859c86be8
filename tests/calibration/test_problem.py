"""A problem names what is wrong with it before anything is computed."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.recorded import Conditions, draw_recording

from aoicell.calibration.problem import (
    CalibrationView,
    Eye,
    Fixture,
    PoseSight,
    Problem,
    Sight,
    moves,
    pairs_seen,
    sights_of,
)
from aoicell.errors import InputError
from aoicell.transforms import SE3, translation


@pytest.fixture(scope="module")
def problem() -> Problem:
    return draw_recording(0, Conditions(views=4)).problem


def spoiled(problem: Problem, sight: Sight | PoseSight) -> Problem:
    return problem.with_views([replace(problem.views[0], sights=(sight,))])


def test_each_eye_sees_each_fixture_in_a_settled_order(problem: Problem) -> None:
    ((eye, fixture),) = pairs_seen(problem)
    assert (eye.name, fixture.name) == ("hand", "tabletarget")
    assert moves(eye, fixture)
    assert not moves(replace(eye, mount="base"), fixture)
    assert list(sights_of(problem, eye, fixture)) == [(v, 0) for v in range(4)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"uv_px": np.full((48, 2), np.nan)}, "finite pixel"),
        ({"uv_px": np.zeros((47, 2))}, "48 finite pixel pairs"),
        ({"ids": np.zeros(48, dtype=int)}, "1 different points"),
        ({"ids": np.arange(1, 49)}, "point 48 is not among its 48"),
        ({"eye": "hnad"}, "did you mean 'hand'"),
        ({"fixture": "table"}, "tabletarget"),
    ],
)
def test_a_wrong_sight_is_named(problem: Problem, change: dict[str, object], message: str) -> None:
    sight = problem.views[0].sights[0]
    with pytest.raises(InputError, match=message) as raised:
        spoiled(problem, replace(sight, **change))  # type: ignore[arg-type]
    assert "v00" in str(raised.value)


def test_a_pose_that_is_not_rigid_names_its_view(problem: Problem) -> None:
    view = problem.views[1]
    for T in (
        SE3(view.T_base_flange.rotation * [1, 1, -1], np.zeros(3)),
        SE3(np.eye(3), np.array([0, np.inf, 0])),
        SE3(1.01 * np.eye(3), np.zeros(3)),
    ):
        with pytest.raises(InputError, match="view 'v01': T_base_flange is no rigid"):
            problem.with_views([replace(view, T_base_flange=T)])


def test_joint_angles_have_to_belong_to_the_flange_pose(problem: Problem) -> None:
    view = problem.views[0]
    off = view.T_base_flange * translation(x=0.002)
    with pytest.raises(InputError, match=r"2\.0 mm"):
        problem.with_views([replace(view, T_base_flange=off)])
    with pytest.raises(InputError, match="6 finite joint angles"):
        problem.with_views([replace(view, q=np.zeros(5))])


def test_names_are_unique(problem: Problem) -> None:
    with pytest.raises(InputError, match="view 'v00' is there twice"):
        problem.with_views([problem.views[0]] * 2)


def test_poses_and_pixels_do_not_mix(problem: Problem) -> None:
    pose = PoseSight("hand", "tabletarget", translation(z=0.5))
    with pytest.raises(InputError, match="give its pixels"):
        spoiled(problem, pose)
    blind = Eye("blind", None, "base")
    with pytest.raises(InputError, match="either all"):
        Problem((*problem.eyes, blind), problem.fixtures, ())
    view = CalibrationView("v", SE3.Identity(), (replace(problem.views[0].sights[0], eye="blind"),))
    with pytest.raises(InputError, match="need intrinsics"):
        Problem((blind,), (Fixture("tabletarget", problem.fixtures[0].points),), (view,))
