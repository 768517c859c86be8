"""Where is the board now? One picture, known truth."""

import numpy as np
import pytest
from helpers.layouts import detections

from aoicell.errors import Refused, TargetNotFound
from aoicell.localization import LocalizationConfig, localize
from aoicell.nominal import Nominal
from aoicell.observation import Observation, RobotState
from aoicell.registration import Template, designed_layout
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.layout import Layout, LayoutConfig, locate_layout
from aoicell.transforms import SE3, Array, distance_deg, distance_mm, from_rvec

MOVED = from_rvec([0, 0, np.radians(11)], [0.03, -0.02, 0])


Seen = list[Array]


def case(
    nominal: Nominal, layout: Layout, T_S: SE3, T_N: SE3, without: str = ""
) -> tuple[Template, Seen]:
    """Taught at T_S; the next picture shows the board at T_N."""
    camera, rng = nominal.cameras["hand"], np.random.default_rng(0)
    taught = locate_layout(detections(layout, camera, T_S, rng), layout, camera, T_S)
    state = RobotState(nominal.q_home, nominal.arm.fk(nominal.q_home))
    look = Observation(np.zeros((2, 2), dtype=np.uint8), state)
    return Template(layout, look, taught, ()), detections(layout, camera, T_N, rng, without.split())


def four(nominal: Nominal, without: str = "") -> tuple[Template, Seen, SE3]:
    T_S = nominal.overview.T_target_camera.inverse()
    layout = designed_layout(nominal.board, CrossMarker())
    return (*case(nominal, layout, T_S, T_S * MOVED, without), T_S * MOVED)


@pytest.mark.parametrize("without", ["", "M1", "M2", "M3", "M4"])
def test_the_board_is_where_it_is(nominal: Nominal, without: str) -> None:
    template, seen, T_N = four(nominal, without)
    located = localize(template.look, seen, template, nominal.cameras["hand"])
    assert distance_mm(located.T_camera_target, T_N) < 1e-4
    assert distance_deg(located.T_camera_target, T_N) < 1e-4


def test_the_single_marker_is_enough_for_its_own_template(nominal: Nominal) -> None:
    T_S = nominal.check.T_target_camera.inverse()
    template, seen = case(nominal, {"M1": CrossMarker().crosses}, T_S, T_S * MOVED)
    located = localize(template.look, seen, template, nominal.cameras["hand"])
    assert distance_mm(located.T_camera_target, T_S * MOVED) < 1e-4


def test_two_of_four_are_too_few(nominal: Nominal) -> None:
    template, seen, T_N = four(nominal, "M2 M3")
    camera = nominal.cameras["hand"]
    with pytest.raises(TargetNotFound, match=r"2 of 4 markers found, 3 needed \(missing: M2, M3;"):
        localize(template.look, seen, template, camera)
    fewer = localize(template.look, seen, template, camera, LocalizationConfig(min_markers=2))
    assert distance_mm(fewer.T_camera_target, T_N) < 1e-4


def test_the_layouts_config_is_passed_on(nominal: Nominal) -> None:
    template, seen, _ = four(nominal)
    config = LocalizationConfig(layout=LayoutConfig(max_turn_deg=5))
    with pytest.raises(Refused, match="at most 5 deg is accepted"):
        localize(template.look, seen, template, nominal.cameras["hand"], config)


def test_it_refuses_when_there_is_no_board(nominal: Nominal) -> None:
    template, seen, _ = four(nominal, "M1 M2 M3 M4")
    with pytest.raises(TargetNotFound, match="bring the board back into view"):
        localize(template.look, seen, template, nominal.cameras["hand"])
