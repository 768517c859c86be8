"""What a picture of the board shows where, against projection."""

import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.relief import Relief, relief_of
from aoicell.transforms import Array, from_rvec

TILTED = from_rvec([0.03, -0.02, 0.4], [0.01, 0.02, 0.0])


@pytest.fixture(scope="module")
def relief(nominal: Nominal) -> Relief:
    T_camera_board = nominal.overview.T_target_camera.inverse() * TILTED
    return relief_of(nominal.board, nominal.cameras["hand"], T_camera_board)


def seen(relief: Relief, points: Array) -> Array:
    """What the pixels show that the points (N, 3) are projected to."""
    return relief.points(relief.camera.project(points, relief.T_camera_board))


@pytest.mark.parametrize("id", ["HS1", "BT1", "LBL2"])
def test_a_component_is_seen_at_its_upper_side(nominal: Nominal, relief: Relief, id: str) -> None:
    component = nominal.board.component(id)
    top = np.array([[component.x, component.y, component.top]])
    np.testing.assert_allclose(seen(relief, top), top, atol=1e-6)


def test_the_laminate_is_flat(relief: Relief) -> None:
    free = np.array([[0.0, -0.150, 0.0], [-0.2, 0.0, 0.0]])
    np.testing.assert_allclose(seen(relief, free), free, atol=1e-6)


def test_markers_and_the_table_are_left_out(nominal: Nominal, relief: Relief) -> None:
    marker = nominal.board.markers[1]
    left_out = np.array([[marker.x, marker.y, marker.z], [0.25, 0.0, 0.0], [0.0, -0.18, 0.0]])
    assert np.isnan(seen(relief, left_out)).all()


def test_a_high_component_hides_what_is_behind_it(nominal: Nominal, relief: Relief) -> None:
    """CPU1 lies under its heat sink."""
    socket = nominal.board.component("CPU1")
    shown = seen(relief, np.array([[socket.x, socket.y, socket.top]]))
    assert shown[0, 2] == pytest.approx(nominal.board.component("HS1").top, abs=1e-6)
