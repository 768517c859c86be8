"""Template login of a board whose markers bear codes: taught in whatever turn it lies."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.errors import Refused
from aoicell.localization import localize
from aoicell.nominal import Nominal
from aoicell.observation import Observation, RobotState
from aoicell.registration import designed_layout, measured_layout, register
from aoicell.targets.layout import Layout
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.transforms import SE3, distance_mm, from_xyz_rpy

TURN = from_xyz_rpy([0.01, -0.02, 0], [0, 0, np.radians(170)])


@pytest.fixture(scope="module", params=["coded", "apriltag"])
def cell(nominal: Nominal, request: pytest.FixtureRequest) -> Nominal:
    return nominal.with_markers(request.param)


def sighted(cell: Nominal, layout: Layout, T_camera_board: SE3) -> list[MarkerSighting]:
    camera: Camera = cell.cameras["hand"]
    return [
        MarkerSighting(camera.project(points, T_camera_board), np.full(4, 0.05), code)
        for points, code in zip(layout.values(), cell.marker_codes.values(), strict=True)
    ]


def test_a_board_that_lies_the_other_way_round_is_taught(cell: Nominal) -> None:
    camera, design = cell.cameras["hand"], designed_layout(cell.board, cell.marker)
    real = {**design, "M3": design["M3"] + [0.0008, -0.0005, 0]}
    expected = [
        cell.overview.T_target_camera.inverse(),
        replace(cell.overview, distance=0.9).T_target_camera.inverse(),
    ]
    shown = [sighted(cell, real, T * TURN) for T in expected]
    codes = cell.marker_codes
    layout, _ = measured_layout(shown, expected, design, camera, "M1", codes)
    for id, points in real.items():
        np.testing.assert_allclose(layout[id], points, atol=1e-7)
    state = RobotState(cell.q_home, cell.arm.fk(cell.q_home))
    look = Observation(np.zeros((2, 2), dtype=np.uint8), state)
    template = register(look, shown[0], (), layout, camera, expected[0], codes=codes)
    assert distance_mm(template.taught.T_camera_target, expected[0] * TURN) < 1e-3
    with pytest.raises(Refused, match="turned by 170 deg"):
        register(look, shown[0], (), layout, camera, expected[0])
    # and then found lying as designed
    located = localize(look, sighted(cell, real, expected[0]), template, camera, codes=codes)
    assert distance_mm(located.T_camera_target, expected[0]) < 1e-3


def test_a_marker_of_another_kind_is_not_looked_for(cell: Nominal) -> None:
    first, *others = cell.board.markers
    plain = replace(first, kind="cross", code="", role="measuring")
    tags = [replace(m, role="positioning" if m.id == "M2" else m.role) for m in others]
    mixed = replace(cell, board=replace(cell.board, markers=(plain, *tags)))
    assert mixed.marker_codes == {**cell.marker_codes, "M1": None}
    alien = replace(first, kind="charuco", code="1", role="measuring")
    mixed = replace(cell, board=replace(cell.board, markers=(alien, *tags)))
    assert mixed.marker_codes == {**cell.marker_codes, "M1": None}
