"""The figure of a program's joint paths shows what the drives do."""

import numpy as np
import pytest
from helpers.programs import TWO_VIEWS

from aoicell.nominal import Nominal
from aoicell.planning.program import Program, plan_program
from aoicell.report.joint_paths import joint_paths, picture_times, trajectory
from aoicell.robot.trajectories import plan


@pytest.fixture(scope="module")
def program(nominal: Nominal) -> Program:
    return plan_program(nominal, nominal.inspection_views).program


def test_the_trajectory_passes_all_stops_at_their_times(nominal: Nominal, program: Program) -> None:
    times, angles_deg = trajectory(program, nominal.arm)
    assert (np.diff(times) >= 0).all()
    assert times[-1] == pytest.approx(program.duration)
    time = 0.0
    for move in program.moves:
        time += move.duration
        there = angles_deg[np.abs(times - time).argmin()]
        np.testing.assert_allclose(there, move.joints_deg, atol=1e-6)


def test_it_keeps_to_the_limits(nominal: Nominal, program: Program) -> None:
    times, angles_deg = trajectory(program, nominal.arm)
    angles = np.radians(angles_deg)
    assert (angles >= nominal.arm.lower).all()
    assert (angles <= nominal.arm.upper).all()
    moving = np.diff(times) > 0
    rates = np.abs(np.diff(angles, axis=0)[moving] / np.diff(times)[moving, None])
    assert (rates <= nominal.arm.velocity_limits * (1 + 1e-9)).all()


def test_pictures_stand_where_they_are_taken() -> None:
    times = picture_times(TWO_VIEWS)
    assert list(times) == ["V1", "V4"]
    assert times["V1"] == 1.0
    assert times["V4"] == pytest.approx(1.4157806535222379)


def test_the_figure_has_a_panel_a_joint_with_its_limits_and_the_pictures(
    nominal: Nominal, program: Program
) -> None:
    figure = joint_paths(program, nominal.arm)
    assert len(figure.axes) == nominal.arm.dof
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert texts == ["limits -170 to 170°", *program.views]
    for panel, move in zip(figure.axes, zip(*stops_deg(program), strict=True), strict=True):
        drawn = panel.lines[0].get_ydata()
        assert min(move) == pytest.approx(np.min(drawn), abs=0.2)
        assert max(move) == pytest.approx(np.max(drawn), abs=0.2)


def stops_deg(program: Program) -> list[tuple[float, ...]]:
    return [program.start_deg, *(move.joints_deg for move in program.moves)]


def test_a_move_takes_as_long_as_the_drives_need(nominal: Nominal, program: Program) -> None:
    first = program.moves[0]
    assert first.duration == pytest.approx(plan(nominal.arm, nominal.q_home, first.q).duration)
