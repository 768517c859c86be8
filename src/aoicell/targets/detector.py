"""How targets are found in an observation: a protocol, and the detection in pictures."""

from typing import Protocol
from weakref import WeakKeyDictionary

from aoicell.camera import Camera
from aoicell.observation import Observation
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.marker import Marker, sight_markers
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.transforms import Array


class Detector(Protocol):
    """Points of targets in raw pixels. Raises TargetNotFound for a board that is not in view."""

    def chessboard(self, observation: Observation, board: Chessboard, name: str) -> Array:
        """Inner corners (N, 2) of the one board in view, up to a half turn."""

    def chessboard_pair(
        self, observation: Observation, board: Chessboard, name: str
    ) -> tuple[Array, Array]:
        """Inner corners of two boards of the same layout, the larger image first."""

    def markers(self, observation: Observation, marker: Marker) -> list[Array]:
        """Cross centres (4, 2) of every marker in view, up to quarter turns."""

    def sightings(
        self, observation: Observation, marker: Marker, camera: Camera | None = None
    ) -> list[MarkerSighting]:
        """The same with what each marker says of itself, and how exact its points are.

        With the camera its distortion is in the model of what is fitted.
        """


class PictureDetector:
    """Finds targets in the pictures themselves."""

    def chessboard(self, observation: Observation, board: Chessboard, name: str) -> Array:
        """See `Chessboard.detect`."""
        return board.detect(observation.grey, name)

    def chessboard_pair(
        self, observation: Observation, board: Chessboard, name: str
    ) -> tuple[Array, Array]:
        """See `Chessboard.detect_pair`."""
        return board.detect_pair(observation.grey, name)

    def markers(self, observation: Observation, marker: Marker) -> list[Array]:
        """See `Marker.detect`."""
        return marker.detect(observation.grey)

    def sightings(
        self, observation: Observation, marker: Marker, camera: Camera | None = None
    ) -> list[MarkerSighting]:
        """See `sight_markers`."""
        return sight_markers(marker, observation.grey, camera)


IN_PICTURES = PictureDetector()


class Remembering:
    """A detector that looks for a target once in each picture, however often it is asked."""

    def __init__(self, detector: Detector) -> None:
        self._detector = detector
        self._found: WeakKeyDictionary[Observation, _Found] = WeakKeyDictionary()
        self._boards: WeakKeyDictionary[Observation, dict[Chessboard, Array]] = WeakKeyDictionary()

    def chessboard(self, observation: Observation, board: Chessboard, name: str) -> Array:
        """As the detector does, the first time that it finds the board."""
        found = self._boards.setdefault(observation, {})
        if board not in found:
            found[board] = self._detector.chessboard(observation, board, name)
        return found[board]

    def chessboard_pair(
        self, observation: Observation, board: Chessboard, name: str
    ) -> tuple[Array, Array]:
        """As the detector does."""
        return self._detector.chessboard_pair(observation, board, name)

    def markers(self, observation: Observation, marker: Marker) -> list[Array]:
        """The points of its sightings."""
        return [seen.uv_px for seen in self.sightings(observation, marker)]

    def sightings(
        self, observation: Observation, marker: Marker, camera: Camera | None = None
    ) -> list[MarkerSighting]:
        """As the detector does, the first time for each camera."""
        found = self._found.setdefault(observation, {})
        if id(camera) not in found:
            found[id(camera)] = camera, self._detector.sightings(observation, marker, camera)
        return found[id(camera)][1]


# by the id of a camera, which is kept so that its id stays its own: it has no hash
_Found = dict[int, tuple[Camera | None, list[MarkerSighting]]]
