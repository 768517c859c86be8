from dataclasses import replace

import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.sim.depth_noise import (
    STEREO,
    STRUCTURED_LIGHT,
    cosine_of_incidence,
    measured,
    shadowed,
)

CAMERA = Camera.pinhole(600.0, 240, 160)
SENSOR = replace(STRUCTURED_LIGHT, camera=CAMERA)
PERFECT = replace(
    SENSOR, disparity_sigma_px=0.0, lateral_sigma_px=0.0, depth_step=1e-9, reach=(0.1, 5.0)
)


def plane(distance, lean=0.0):
    """Depth of a plane through the axis at `distance`, leaning about y by `lean` (rad)."""
    x = (np.arange(CAMERA.width) - CAMERA.K[0, 2]) / CAMERA.focal_px
    row = distance / (1 - np.tan(lean) * x)
    return np.tile(row, (CAMERA.height, 1)).astype(np.float32)


def step(near=0.45, far=0.50, edge=120):
    depth = np.full((CAMERA.height, CAMERA.width), far, np.float32)
    depth[:, edge:] = near
    return depth


def rng():
    return np.random.default_rng(3)


@pytest.mark.parametrize("sensor", [STRUCTURED_LIGHT, STEREO], ids=lambda s: s.name)
def test_noise_grows_with_the_square_of_the_distance(sensor):
    sensor = replace(sensor, camera=CAMERA, reach=(0.05, 5), disparity_step_px=0, depth_step=1e-9)
    spread = [np.nanstd(measured(plane(z), sensor, 1.0, rng()) - z) for z in (0.3, 0.6)]
    assert spread[0] == pytest.approx(sensor.sigma(0.3), rel=0.1)
    assert spread[1] / spread[0] == pytest.approx(4.0, rel=0.1)


def test_noise_grows_towards_grazing_angles():
    spreads = []
    for lean in (0.0, 1.0):
        true = plane(0.45, lean)
        middle = np.s_[:, 110:130]
        sensor = replace(SENSOR, lateral_sigma_px=0.0)
        spreads.append(np.nanstd((measured(true, sensor, 1.0, rng()) - true)[middle]))
    assert spreads[1] / spreads[0] == pytest.approx(1 / np.cos(1.0), rel=0.1)


def test_neighbouring_pixels_share_noise():
    noise = measured(plane(0.45), replace(SENSOR, correlation_px=2.0), 1.0, rng()) - 0.45
    near = np.corrcoef(noise[:, 1:].ravel(), noise[:, :-1].ravel())[0, 1]
    far = np.corrcoef(noise[:, 20:].ravel(), noise[:, :-20].ravel())[0, 1]
    assert near > 0.8
    assert abs(far) < 0.1


def test_disparity_is_counted_in_steps():
    sensor = replace(PERFECT, disparity_step_px=1 / 32, disparity_sigma_px=0.05)
    seen = measured(plane(0.45), sensor, 1.0, rng())
    counts = CAMERA.focal_px * sensor.baseline / seen * 32
    assert np.unique(np.rint(counts)).size > 3
    assert counts == pytest.approx(np.rint(counts), abs=1e-2)


def test_a_device_has_a_scale_of_its_own():
    assert measured(plane(0.5), PERFECT, 1.01, rng()) == pytest.approx(0.505, rel=1e-5)


def test_a_perfect_device_sees_the_truth():
    true = plane(0.5, 0.3)
    assert measured(true, PERFECT, 1.0, rng()) == pytest.approx(true, rel=1e-5)


def test_beyond_its_reach_and_at_grazing_angles_it_sees_nothing():
    sensor = replace(PERFECT, reach=(0.4, 0.6), grazing=float(np.radians(50)))
    assert np.isnan(measured(plane(0.39), sensor, 1.0, rng())).all()
    assert np.isnan(measured(plane(0.61), sensor, 1.0, rng())).all()
    assert np.isnan(measured(plane(0.5, 1.0), sensor, 1.0, rng())[:, 118:122]).all()
    assert np.isfinite(measured(plane(0.5, 0.6), sensor, 1.0, rng())[:, 118:122]).all()


def test_the_cosine_of_a_leaning_plane():
    cosine = cosine_of_incidence(plane(0.5, 0.7), CAMERA)
    assert cosine[80, 119:121] == pytest.approx(np.cos(0.7), abs=0.01)
    assert cosine_of_incidence(step(), CAMERA)[80, 119:121] == pytest.approx(1, abs=0.01)


def test_what_stands_higher_shadows_what_lies_to_the_left_of_it():
    near, far, edge = 0.45, 0.50, 120
    f_b = CAMERA.focal_px * SENSOR.baseline
    hidden = shadowed(step(near, far, edge), f_b)
    width = f_b / near - f_b / far
    assert not hidden[:, edge:].any()
    assert hidden[0].sum() == pytest.approx(width, abs=2)
    assert hidden[0, edge - int(width) + 2 : edge].all()
    assert not shadowed(step(far, near, edge), f_b)[:, : edge - 1].any()  # lower to the right


def test_mixed_pixels_are_at_edges_between_near_and_far():
    sensor = replace(PERFECT, lateral_sigma_px=0.5, flying=1.0, baseline=1e-4)
    seen = measured(step(), sensor, 1.0, rng())
    mixed = (seen > 0.451) & (seen < 0.499)
    columns = np.flatnonzero(mixed.any(axis=0))
    assert mixed.sum() > 50
    assert columns.min() >= 116
    assert columns.max() <= 124
    filtered = measured(step(), replace(sensor, flying=0.0), 1.0, rng())
    left = (filtered > 0.455 + 1e-4) & (filtered < 0.495 - 1e-4)
    assert not left.any()


def test_the_same_draws_make_the_same_image():
    first, second = (measured(plane(0.5), SENSOR, 1.0, rng()) for _ in range(2))
    assert np.array_equal(first, second, equal_nan=True)
