"""How the joints move through a robot program: angle over time, with limits and pictures."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from aoicell.planning.program import Capture, Program
from aoicell.report.style import NEW, REFERENCE, STANDARD, new_figure
from aoicell.robot import Arm
from aoicell.robot.trajectories import plan
from aoicell.transforms import Array

_SAMPLES = 60  # of a move


def joint_paths(program: Program, arm: Arm) -> Figure:
    """One panel a joint: its angle (deg) over time (s), its limits where they are near, and a
    line where a picture is taken. The moves are those that the drives make; pauses are left out.
    """
    times, angles_deg = trajectory(program, arm)
    pictures = picture_times(program)
    figure = new_figure(7.2, 1.15 * arm.dof + 0.6)
    panels = np.atleast_1d(figure.subplots(arm.dof, 1, sharex=True))
    for joint, panel in enumerate(panels):
        panel.plot(times, angles_deg[:, joint], color=STANDARD, linewidth=1.3)
        _draw_limits(panel, np.degrees([arm.lower[joint], arm.upper[joint]]))
        for time in pictures.values():
            panel.axvline(time, color=REFERENCE, linewidth=0.6, linestyle=":")
        panel.set_ylabel(f"{arm.joint_names[joint]}\n(°)", fontsize=8)
        panel.tick_params(labelsize=8)
    for view, time in pictures.items():
        panels[0].annotate(
            view, (time, 1.02), xycoords=("data", "axes fraction"), rotation=60, fontsize=7,
            color=REFERENCE,
        )  # fmt: skip
    panels[-1].set_xlabel("time in motion (s)", fontsize=8)
    return figure


def trajectory(program: Program, arm: Arm) -> tuple[Array, Array]:
    """Times (N,; s) and joint angles (N, dof; deg) along all moves."""
    stops = [np.radians(program.start_deg), *(move.q for move in program.moves)]
    times, angles, began = [np.zeros(1)], [stops[0][None]], 0.0
    for q_from, q_to in pairwise(stops):
        move = plan(arm, q_from, q_to)
        along = np.linspace(0, move.duration, _SAMPLES)
        times.append(began + along)
        angles.append(np.array([move.sample(t) for t in along]))
        began += move.duration
    return np.concatenate(times), np.degrees(np.vstack(angles))


def picture_times(program: Program) -> dict[str, float]:
    """Time in motion (s) at which each view is photographed."""
    times, time = {}, 0.0
    for step in program.steps:
        if isinstance(step, Capture):
            times[step.view] = time
        else:
            time += step.duration
    return times


def _draw_limits(panel: Axes, limits_deg: Array) -> None:
    """Both limits in the margins of the panel: drawn where they are near, told where they are not.

    All panels down to the widest limit would show flat lines.
    """
    low, high = panel.get_ylim()
    for limit in limits_deg:
        if low - (high - low) <= limit <= high + (high - low):
            panel.axhline(limit, color=NEW, linewidth=1.0, linestyle="--")
    told = f"limits {limits_deg[0]:.0f} to {limits_deg[1]:.0f}°"
    panel.annotate(told, (0.995, 0.06), xycoords="axes fraction", ha="right", fontsize=7, color=NEW)
