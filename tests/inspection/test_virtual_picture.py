"""A picture drawn from the design as the standard of a view."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from aoicell.camera import Camera
from aoicell.inspection import Reference, ViewInspection, inspect_view
from aoicell.inspection.virtual_picture import BEYOND, drawing, virtual_picture
from aoicell.nominal import Nominal
from aoicell.observation import Image
from aoicell.sim.twin import NominalTwin
from aoicell.transforms import SE3, apply, looking_at, translation
from inspection.scenes import Look, gives_no_verdict, is_finite

HIGH = 3e-3
DESIGNED = Camera.pinhole(1000.0, 640, 480)


class Dots:
    """A renderer that draws a disc where points of the board are, and remembers the poses."""

    points = np.array([[0.0, 0.0, 0.0], [0.05, 0.02, 0.0], [-0.06, 0.04, 0.0], [0.03, -0.05, 0.0]])

    def render(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        v, u = np.mgrid[: DESIGNED.height, : DESIGNED.width]
        picture = np.zeros((DESIGNED.height, DESIGNED.width, 3), np.uint8)
        for at in DESIGNED.project(apply(T_base_camera.actInv(T_base_board), self.points)):
            picture[(u - at[0]) ** 2 + (v - at[1]) ** 2 < 7**2] = 200
        return picture

    def half_turned(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        return np.full((DESIGNED.height, DESIGNED.width, 3), 120, np.uint8)

    def bare(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        return np.full((DESIGNED.height, DESIGNED.width, 3), 90, np.uint8)

    def solids(
        self, T_base_camera: SE3, T_base_board: SE3
    ) -> tuple[NDArray[np.int16], NDArray[np.float32]]:
        """Discs of the components 0, 1, ... on a plane `HIGH` over the board."""
        T = T_base_camera.actInv(T_base_board)
        v, u = np.mgrid[: DESIGNED.height, : DESIGNED.width]
        numbers = np.full(u.shape, -1, np.int16)
        for number, at in enumerate(DESIGNED.project(apply(T, self.points))):
            numbers[(u - at[0]) ** 2 + (v - at[1]) ** 2 < 7**2] = number
        rays = np.moveaxis(np.mgrid[: DESIGNED.height, : DESIGNED.width], 0, -1)[..., ::-1]
        rays = np.dstack([rays, np.ones(rays.shape[:2])]) @ np.linalg.inv(DESIGNED.K).T
        normal = T.rotation[:, 2]
        depths = normal @ T.act(np.array([0, 0, HIGH])) / (rays @ normal)
        return numbers, depths.astype(np.float32)


def test_it_is_drawn_through_the_calibrated_lens() -> None:
    """Focal length, middle and distortion are the calibrated camera's, and so is the pose."""
    K = np.array([[1040, 0, 325], [0, 1030, 230], [0, 0, 1.0]])
    camera = replace(DESIGNED, K=K, distortion=np.array([-0.1, 0.02, 0.001, 0, 0]))
    T_base_board = translation(0.4, 0.1, 0.02)
    T_base_camera = T_base_board * looking_at((0.005, 0, 0), 0.45, (0.1, -0.05), 0.4)
    T_camera_board = T_base_camera.actInv(T_base_board)
    image = virtual_picture(Dots(), DESIGNED, camera, T_base_camera, T_camera_board)
    assert image.shape == (480, 640)
    for at in camera.project(Dots.points, T_camera_board):
        left, top = (round(value) - 12 for value in at)
        rows, columns = np.nonzero(image[max(top, 0) : top + 25, max(left, 0) : left + 25] > 100)
        middle = np.array([columns.mean() + max(left, 0), rows.mean() + max(top, 0)])
        assert np.linalg.norm(middle - at) < 0.5


def test_solids_are_drawn_through_it_as_well() -> None:
    """With heights over the board, whichever way it lies, and nothing where the drawing ends."""
    camera = replace(DESIGNED, K=np.array([[900, 0, 330], [0, 905, 235], [0, 0, 1.0]]))
    T_base_board = translation(0.4, 0.1, 0.02)
    T_base_camera = T_base_board * looking_at((0.005, 0, 0), 0.45, (0.1, -0.05), 0.4)
    T_camera_board = T_base_camera.actInv(T_base_board)
    drawn = drawing(Dots(), DESIGNED, camera, T_base_camera, T_camera_board)
    for number, (u, v) in enumerate(camera.project(Dots.points, T_camera_board)):
        assert drawn.numbers[round(v), round(u)] == number
    assert drawn.numbers[0, 0] == BEYOND
    known = drawn.numbers != BEYOND
    assert (drawn.bare[known] == 90).all()
    assert drawn.heights[known] == pytest.approx(HIGH, abs=1e-6)


# ---- in the cell -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def virtual(nominal: Nominal, taught: Look, twin: NominalTwin) -> Reference:
    pose = (taught.T_base_camera, taught.T_camera_board)
    image = virtual_picture(twin, nominal.cameras["hand"], taught.camera, *pose)
    return Reference("V3", (image,), taught.T_camera_board, taught.camera, virtual=True)


@pytest.fixture(scope="module")
def found(virtual: Reference, spoilt: Look, nominal: Nominal) -> ViewInspection:
    return inspect_view(spoilt.grey, virtual, nominal.board)


def test_a_picture_registers_to_it(found: ViewInspection) -> None:
    assert found.registration.state in ("registered", "degraded")
    assert found.registration.moved_px > 5
    assert is_finite(found)


@pytest.mark.parametrize("id", ["C24", "L17", "J30"])
def test_it_misses_a_large_part(found: ViewInspection, id: str) -> None:
    assert found.findings[id].is_defect


def test_most_good_parts_are_present(found: ViewInspection) -> None:
    """Nobody's grey values: more is called than against a golden sample."""
    states = [finding.state for finding in found.findings.values()]
    assert len(states) > 50
    assert states.count("present") > 0.5 * len(states)


def test_it_gives_no_verdict_on_something_else(virtual: Reference, nominal: Nominal) -> None:
    upside_down = np.ascontiguousarray(virtual.images[0][::-1, ::-1])
    assert gives_no_verdict(inspect_view(upside_down, virtual, nominal.board))
