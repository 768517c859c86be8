"""What was detected is drawn where it is."""

import cv2
import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.nominal import Nominal
from aoicell.observation import CameraName, Observation, RobotState
from aoicell.targets.detector import IN_PICTURES
from aoicell.transforms import SE3
from aoicell.view.picture import GREEN, WIDTH, detect, draw_detections

CAMERA = Camera.pinhole(1400, 1600, 1200)


def observe(image: np.ndarray, camera: CameraName = "hand") -> Observation:
    return Observation(image, RobotState(np.zeros(6), SE3.Identity()), camera)


def green_centre(drawn: np.ndarray) -> np.ndarray:
    """Mean place (u, v) of the pixels that are green."""
    distance = np.abs(drawn.astype(int) - GREEN).sum(axis=2)
    v, u = np.nonzero(distance < 120)
    return np.array([u.mean(), v.mean()])


@pytest.mark.parametrize("shape", [(1200, 1600), (1200, 1600, 3), (0, 0)], ids=str)
def test_a_detection_is_drawn_at_its_place(shape: tuple[int, ...]) -> None:
    uv = np.array([[400.3, 900.7]])
    drawn = draw_detections(observe(np.full(shape, 128, np.uint8)), [uv], CAMERA)
    assert drawn.shape == (WIDTH * 3 // 4, WIDTH, 3)
    expected = (uv[0] + 0.5) * WIDTH / 1600 - 0.5
    np.testing.assert_allclose(green_centre(drawn), expected, atol=0.3)


def test_without_detections_the_picture_is_the_picture() -> None:
    image = np.full((1200, 1600), 77, np.uint8)
    assert (draw_detections(observe(image), [], CAMERA) == 77).all()


def test_the_picture_itself_is_left_alone() -> None:
    image = np.full((300, WIDTH, 3), 77, np.uint8)  # nothing to scale
    draw_detections(observe(image), [np.array([[50.0, 50.0]])], CAMERA)
    assert (image == 77).all()


def on_white(nominal: Nominal) -> np.ndarray:
    """A chessboard of 20 px a square somewhere in a picture."""
    print_image = nominal.tabletarget.print_image()
    small = cv2.resize(print_image, (400, 320), interpolation=cv2.INTER_AREA)
    image = np.full((1200, 1600), 255, np.uint8)
    image[300:620, 500:900] = small
    return image


def test_a_calibration_picture_shows_its_chessboard(nominal: Nominal) -> None:
    observation = observe(on_white(nominal))
    [corners], words = detect(observation, nominal, IN_PICTURES, calibrating=True)
    assert len(corners) == len(nominal.tabletarget.corners)
    assert words == f"chessboard found, {len(corners)} corners"


def test_what_is_not_found_is_said(nominal: Nominal) -> None:
    blank = np.full((1200, 1600), 128, np.uint8)
    found, words = detect(observe(blank), nominal, IN_PICTURES, calibrating=True)
    assert found == []
    assert "hand picture" in words
    found, words = detect(observe(blank, "tripod"), nominal, IN_PICTURES, calibrating=True)
    assert found == []
    assert "tripod picture" in words
    assert detect(observe(blank), nominal, IN_PICTURES, False) == ([], "0 markers found")
