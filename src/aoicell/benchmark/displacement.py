"""How the board moves in a trial, drawn from what the scenario says."""

import numpy as np

from aoicell.scenario import Displacement, Range, Scenario
from aoicell.sim.drawing import stream
from aoicell.sim.world import World
from aoicell.transforms import SE3, from_rvec


def draw_displacement(
    scenario: Scenario, world: World, T_base_board_taught: SE3, trial: int
) -> SE3:
    """T_base_motion of the board, about the true centre of its positioning marker."""
    rng = stream(scenario.seed, world.as_built.world, trial, "displacement")
    id = world.nominal.positioning.id
    T_base_marker = T_base_board_taught * world.geometry.Ts_board_marker[id]
    return motion_about(T_base_marker.translation, scenario.displacement, rng, trial)


def motion_about(
    centre: np.ndarray, displacement: Displacement, rng: np.random.Generator, trial: int
) -> SE3:
    """T_base_motion of a drawn displacement about a point (3,) in base."""

    def uniform(range_: Range) -> float:
        return float(rng.uniform(range_.min, range_.max))

    drawn = uniform(displacement.shift_mm) if isinstance(displacement.shift_mm, Range) else None
    shift = displacement.shift_mm[trial] if drawn is None else drawn  # type: ignore[index]
    direction, axis = rng.uniform(0, 2 * np.pi, 2)
    turn, tilt = np.radians([uniform(displacement.turn_deg), uniform(displacement.tilt_deg)])
    lift = uniform(displacement.lift_mm)
    shift_in_plane = np.sqrt(max(shift**2 - lift**2, 0.0))
    step = np.array([shift_in_plane * np.cos(direction), shift_in_plane * np.sin(direction), lift])
    lean = from_rvec([tilt * np.cos(axis), tilt * np.sin(axis), 0], np.zeros(3))
    rotate = from_rvec([0, 0, turn], np.zeros(3)) * lean
    to_centre = SE3(np.eye(3), np.array(centre))
    return SE3(np.eye(3), step / 1e3) * to_centre * rotate * to_centre.inverse()
