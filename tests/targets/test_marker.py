"""All kinds of markers are made, printed and found in the same way."""

import numpy as np
import pytest

from aoicell.errors import InputError
from aoicell.observation import Image
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.marker import MARKERS, make_marker, sight_markers
from aoicell.transforms import Array


@pytest.mark.parametrize("kind", MARKERS)
def test_every_kind_on_the_same_square(kind: str) -> None:
    known = MARKERS[kind]
    marker = make_marker(kind, 0.060, known.share * 0.060, known.codes[-1])
    assert marker.size == 0.060
    assert np.abs(marker.crosses[:, :2]).max() == pytest.approx(known.share * 0.030)
    assert marker.print_image(300).shape == (300, 300)
    pitch = 0.060 * known.share
    assert known.least_size(pitch) <= 0.060 + 1e-9
    with pytest.raises(InputError, match="at least"):
        make_marker(kind, known.least_size(pitch) - 1e-3, pitch)


def test_crosses_that_run_into_each_other_are_refused() -> None:
    with pytest.raises(InputError, match=r"pitch of 15 mm run into each other.* 19\.5 mm"):
        make_marker("cross", 0.060, 0.015)


def test_a_marker_that_can_only_detect_is_sighted_without_a_deviation() -> None:
    class Simple:
        """What another package may bring."""

        size = 0.060
        crosses = outline = np.zeros((4, 3))

        def print_image(self, pixels: int = 640) -> Image:
            return np.zeros((pixels, pixels), dtype=np.uint8)

        def detect(self, grey: Image) -> list[Array]:
            return [np.eye(4)[:, :2]]

    (seen,) = sight_markers(Simple(), np.zeros((5, 5), dtype=np.uint8))
    assert seen.code is None
    assert np.isnan(seen.sigma_px).all()
    np.testing.assert_array_equal(seen.uv_px, np.eye(4)[:, :2])


def test_detection_is_the_points_of_the_sightings() -> None:
    print_ = np.pad(CrossMarker().print_image(200), 60, constant_values=60)
    (uv,) = CrossMarker().detect(print_)
    (seen,) = sight_markers(CrossMarker(), print_)
    np.testing.assert_array_equal(uv, seen.uv_px)
