"""The display follows the arm and tells what goes on."""

import numpy as np

from aoicell.scenario import Scenario
from aoicell.sim.cell import SimCell
from aoicell.sim.world import World
from aoicell.targets.detector import IN_PICTURES
from aoicell.view.display import Display
from aoicell.view.shown import Shown
from aoicell.view.watched import Gate, WatchedCell


def watched(world: World, speed: float) -> tuple[WatchedCell, Display, list[Shown]]:
    seen: list[Shown] = []
    scenario = Scenario(name="x", title="A title", profile="ideal")
    display = Display(scenario, world, IN_PICTURES, Gate(), speed)
    display.show = seen.append
    return WatchedCell(SimCell(world), display), display, seen


def test_a_move_is_shown_from_its_start_to_its_end(ideal_world: World) -> None:
    arm, q_home = ideal_world.nominal.arm, ideal_world.nominal.q_home
    cell, _, seen = watched(ideal_world, speed=3.0)
    q = q_home + np.array([0.4, 0, 0, 0, 0, 0])
    cell.move(q)
    T_base_world = ideal_world.nominal.T_world_base.inverse()
    Ts = [T_base_world * shown.Ts_world_body["arm/flange"] for shown in seen]
    turned = [float(np.linalg.norm((arm.fk(q_home).actInv(T)).translation)) for T in Ts]
    assert len(Ts) > 3
    assert turned[0] < 0.2 * turned[-1]
    assert (np.diff(turned) > -1e-9).all(), "there is no way back"
    assert Ts[-1].isApprox(arm.fk(q), 1e-6)


def test_the_estimated_flange_goes_with_the_arm(ideal_world: World) -> None:
    cell, _, seen = watched(ideal_world, speed=3.0)
    cell.move(ideal_world.nominal.q_home + np.array([0, 0.3, 0, 0, 0, 0]))
    for shown in seen:
        believed = next(a for a in shown.axes if a.name == "flange" and a.estimate)
        assert believed.T_body_frame.isApprox(shown.Ts_world_body["arm/flange"], 1e-6)


def test_a_move_to_the_same_place_ends(ideal_world: World) -> None:
    cell, _, seen = watched(ideal_world, speed=1.0)
    cell.move(ideal_world.nominal.q_home)
    assert seen


def test_pictures_come_with_their_detections_and_phases_with_their_names(
    ideal_world: World,
) -> None:
    cell, display, seen = watched(ideal_world, speed=1e9)
    display.tell("thinking")
    cell.capture("tripod")
    assert ("A title", "") in seen[-1].rows
    assert ("phase", "thinking") in seen[-1].rows
    assert seen[-1].picture is not None
    assert seen[-1].caption.startswith("tripod camera, picture 1: ")
