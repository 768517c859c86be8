"""How targets are found in an observation: a protocol, and the detection in pictures."""

from typing import Protocol
from weakref import WeakKeyDictionary

from aoicell.observation import Observation
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.marker import Marker
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


IN_PICTURES = PictureDetector()


class Remembering:
    """A detector that looks for markers once in each picture, however often it is asked."""

    def __init__(self, detector: Detector) -> None:
        self._detector = detector
        self._found: WeakKeyDictionary[Observation, list[Array]] = WeakKeyDictionary()

    def chessboard(self, observation: Observation, board: Chessboard, name: str) -> Array:
        """As the detector does."""
        return self._detector.chessboard(observation, board, name)

    def chessboard_pair(
        self, observation: Observation, board: Chessboard, name: str
    ) -> tuple[Array, Array]:
        """As the detector does."""
        return self._detector.chessboard_pair(observation, board, name)

    def markers(self, observation: Observation, marker: Marker) -> list[Array]:
        """As the detector does, the first time."""
        if observation not in self._found:
            self._found[observation] = self._detector.markers(observation, marker)
        return self._found[observation]
