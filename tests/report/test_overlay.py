"""Pictures laid over each other for display."""

import cv2
import numpy as np
import pytest

from aoicell.report.overlay import align, difference, warped
from report.inspection_runs import SIZE, moved, texture

CORNERS = np.array([[[20.0, 20.0]], [[300.0, 20.0]], [[300.0, 220.0]], [[20.0, 220.0]]])


def _truth(shift: tuple[float, float], turn_deg: float) -> np.ndarray:
    """The same as `moved` does, of points (N, 1, 2)."""
    middle = ((SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2)
    A = cv2.getRotationMatrix2D(middle, turn_deg, 1.0)
    A[:, 2] += shift
    return np.asarray(cv2.transform(CORNERS, A))


@pytest.mark.parametrize(
    ("shift", "turn_deg"), [((0.0, 0.0), 0.0), ((5.5, -3.0), 1.5), ((45.0, -30.0), 25.0)]
)
def test_a_moved_picture_is_found_again(shift: tuple[float, float], turn_deg: float) -> None:
    """In which direction, too: a picture that is moved to the right has to come back."""
    reference = texture()
    new = moved(reference, shift, turn_deg)
    H = align(new, reference)
    assert H is not None
    found = cv2.perspectiveTransform(CORNERS, H)
    assert found == pytest.approx(_truth(shift, turn_deg), abs=0.5)
    inside = (slice(60, 180), slice(90, 230))
    apart = cv2.absdiff(warped(new, H), reference)[inside]
    assert apart.mean() < 4.0  # interpolated twice; of pictures that do not belong together 40


def test_a_gain_of_the_light_does_not_matter() -> None:
    reference = texture()
    H = align(cv2.convertScaleAbs(moved(reference, (6.0, 4.0)), alpha=0.6, beta=10), reference)
    assert H is not None
    assert cv2.perspectiveTransform(CORNERS, H) == pytest.approx(_truth((6, 4), 0), abs=0.3)


def test_another_picture_is_not_laid_over() -> None:
    assert align(texture(1), texture(0)) is None
    assert align(np.full(SIZE[::-1], 90, np.uint8), texture()) is None


def test_the_difference_shows_what_differs_and_nothing_else() -> None:
    reference = texture()
    new = reference.copy()
    new[100:120, 150:180] = np.where(new[100:120, 150:180] > 127, 0, 255)
    apart = difference(new, reference, np.eye(3))
    assert apart[100:120, 150:180].min() > 200
    assert apart[:95].max() == 0
    to_the_right = np.array([[1.0, 0, 50], [0, 1, 0], [0, 0, 1]])
    beyond = difference(warped(reference, to_the_right), reference, to_the_right)[:, -45:]
    assert np.ptp(beyond) == 0  # one grey where the new picture has ended
