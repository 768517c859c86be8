"""Crosses are found to hundredths of a pixel, and what is stated of them is true."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from helpers.marked import aside, shown, true_px
from helpers.printed import BENT, FINER

from aoicell.observation import Image
from aoicell.targets.cross_marker import CrossMarker, turned
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.targets.pose import rms
from aoicell.transforms import SE3, Array

MARKER = CrossMarker()


def errors(seen: MarkerSighting, T_camera_marker: SE3) -> Array:
    """Found minus true (4, 2) px, in the nearest of the four readings."""
    truth = true_px(MARKER, T_camera_marker)
    return min((turned(seen.uv_px, k) - truth for k in range(4)), key=rms)


@pytest.mark.parametrize("blur", [0.4, 1.0, 2.0])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.5, 0.2), (-0.3, 0.6)])
def test_centres_under_perspective_and_blur(blur: float, tilt: tuple[float, float]) -> None:
    T = aside(0.02, -0.01, roll=0.7, tilt=tilt)
    (seen,) = MARKER.sight(shown((MARKER, T), blur_px=blur), BENT)
    assert rms(errors(seen, T)) < 0.03


def test_the_lens_is_in_the_model_when_the_camera_is_given() -> None:
    corners = [aside(x, y, roll=0.2) for x in (-0.095, 0.095) for y in (-0.06, 0.06)]
    grey = shown(*((MARKER, T) for T in corners), noise=0.0)
    found = MARKER.sight(grey, BENT), MARKER.sight(grey)
    with_lens, straight = (
        rms(np.concatenate([min((errors(s, T) for s in seen), key=rms) for T in corners]))
        for seen in found
    )
    assert with_lens < 0.012
    assert straight > 1.5 * with_lens


@pytest.mark.parametrize("noise", [2.0, 8.0])
def test_the_stated_deviation_is_that_of_the_errors(noise: float) -> None:
    T = aside(0, 0)
    ratios = []
    for seed in range(12):
        (seen,) = MARKER.sight(shown((MARKER, T), noise=noise, seed=seed), BENT)
        ratios.append(errors(seen, T) / seen.sigma_px[:, None])
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.5


def covering(
    T_camera_marker: SE3, x: float, y: float, radius: float, grey: int = 70
) -> Callable[[Image], None]:
    """Paints a disc (m) over a place of the marker."""
    (u, v) = BENT.project(np.array([[x, y, 0.0]]), T_camera_marker)[0]
    scale = BENT.focal_px / T_camera_marker.translation[2]

    def paint(fine: Image) -> None:
        centre = (round(float(u) * FINER), round(float(v) * FINER))
        cv2.circle(fine, centre, round(radius * scale * FINER), grey, -1)

    return paint


def test_a_covered_tip_and_a_covered_frame_do_no_harm() -> None:
    T = aside(0, 0)
    tip = covering(T, 0.018 + 0.009, 0.018, 0.003)  # joins a cross with the frame
    (seen,) = MARKER.sight(shown((MARKER, T), cover=tip), BENT)
    assert rms(errors(seen, T)) < 0.04
    edge = covering(T, 0.030, 0.0, 0.008)
    (seen,) = MARKER.sight(shown((MARKER, T), cover=edge), BENT)
    assert rms(errors(seen, T)) < 0.03


def test_a_covered_cross_is_not_guessed() -> None:
    T = aside(0, 0)
    assert MARKER.sight(shown((MARKER, T), cover=covering(T, 0.018, 0.018, 0.010)), BENT) == []


def test_four_crosses_without_a_frame_are_no_marker() -> None:
    T = aside(0, 0)

    def erase(fine: Image) -> None:
        ring = np.concatenate([MARKER.outline, MARKER.outline[:1]]) * 0.975
        cv2.polylines(fine, [np.rint(BENT.project(ring, T) * FINER).astype(np.int32)], False, 210,
                      round(0.004 * BENT.focal_px / 0.4 * FINER))  # fmt: skip

    assert len(MARKER.sight(shown((MARKER, T)), BENT)) == 1
    assert MARKER.sight(shown((MARKER, T), cover=erase), BENT) == []


def test_what_lies_on_a_bar_does_not_move_its_cross() -> None:
    """Found or not, never wrong: discs of any grey anywhere on the marker."""
    rng, found = np.random.default_rng(5), 0
    for seed in range(20):
        T = aside(0, 0, roll=float(rng.uniform(0, 3)))
        x, y = rng.uniform(-0.03, 0.03, 2)
        cover = covering(T, x, y, 0.008, grey=int(rng.integers(20, 240)))
        for seen in MARKER.sight(shown((MARKER, T), cover=cover, seed=seed), BENT):
            found += 1
            assert rms(errors(seen, T)) < 0.25
    assert found >= 12
