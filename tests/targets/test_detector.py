"""A detector that remembers looks once, for each camera that it is given."""

import numpy as np

from aoicell.camera import Camera
from aoicell.observation import Observation, RobotState
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.detector import IN_PICTURES, PictureDetector, Remembering
from aoicell.targets.marker import Marker
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.transforms import SE3, Array

MARKER = CrossMarker()


def observation() -> Observation:
    print_ = np.pad(MARKER.print_image(200), 60, constant_values=60)
    return Observation(print_, RobotState(np.zeros(6), SE3.Identity()), "hand")


class Counting(PictureDetector):
    """Counts how often it looks."""

    def __init__(self) -> None:
        self.looks: list[Camera | None] = []

    def sightings(
        self, observation: Observation, marker: Marker, camera: Camera | None = None
    ) -> list[MarkerSighting]:
        self.looks.append(camera)
        return super().sightings(observation, marker, camera)


def test_it_looks_once_for_each_camera() -> None:
    counting, shown = Counting(), observation()
    detector, camera = Remembering(counting), Camera.pinhole(900.0, 320, 320)
    first = detector.sightings(shown, MARKER, camera)
    assert detector.sightings(shown, MARKER, camera) is first
    (uv,) = detector.markers(shown, MARKER)
    assert detector.markers(shown, MARKER)[0] is uv
    assert counting.looks == [camera, None]
    detector.markers(observation(), MARKER)
    assert len(counting.looks) == 3


def test_markers_are_the_points_of_sightings() -> None:
    shown = observation()
    (uv,), (seen,) = IN_PICTURES.markers(shown, MARKER), IN_PICTURES.sightings(shown, MARKER)
    np.testing.assert_array_equal(uv, seen.uv_px)
    assert (seen.sigma_px < 0.1).all()


def test_it_looks_for_a_board_once() -> None:
    class Boards(Counting):
        def chessboard(self, observation: Observation, board: Chessboard, name: str) -> Array:
            self.looks.append(None)
            return np.zeros((board.columns * board.rows, 2))

    counting, shown = Boards(), observation()
    detector = Remembering(counting)
    small, large = Chessboard(8, 6, 0.015, 0.01), Chessboard(8, 6, 0.03, 0.01)
    first = detector.chessboard(shown, small, "a board")
    assert detector.chessboard(shown, small, "the same board") is first
    assert detector.chessboard(shown, large, "another") is not first
    assert len(counting.looks) == 2
