"""The lens puts each point where the camera model says; noise is what it is called."""

import cv2
import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.sim.optics import Lens, add_noise
from aoicell.transforms import Array

BENT = Camera(
    np.array([[800.0, 0, 330.0], [0, 800.0, 232.0], [0, 0, 1]]), 640, 480,
    np.array([-0.08, 0, 0, 0, 0]),
)  # fmt: skip


def test_a_plain_camera_needs_no_remapping() -> None:
    lens = Lens(Camera.pinhole(800.0, 640, 480))
    image = np.zeros((480, 640, 3), dtype=np.uint8)
    assert lens.pinhole == (640, 480, 800.0)
    assert lens.expose(image) is image


def test_the_pinhole_covers_the_whole_field() -> None:
    lens = Lens(BENT)
    wide, high, focal = lens.pinhole
    corners = np.array([[0, 0], [639, 0], [639, 479], [0, 479.0]])
    uv = BENT.unproject(corners) * focal + [(wide - 1) / 2, (high - 1) / 2]
    assert (uv >= 1).all()
    assert (uv <= [wide - 2, high - 2]).all()
    assert wide < 1.3 * 640, "and not much more"


def blobs(shape: tuple[int, int], uv_px: Array) -> Image:
    """Bright spots at known places."""
    v, u = np.indices(shape)
    grey = np.full(shape, 20.0)
    for x, y in uv_px:
        grey += 200 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * 3.0**2))
    return np.rint(np.repeat(grey[:, :, None], 3, axis=2)).clip(0, 255).astype(np.uint8)


def centroid(grey: Image, near: Array) -> Array:
    x, y = np.rint(near).astype(int)
    window = grey[y - 12 : y + 13, x - 12 : x + 13].astype(float) - 20
    window[window < 3] = 0
    v, u = np.indices(window.shape) - 12
    return np.array([x + (window * u).sum() / window.sum(), y + (window * v).sum() / window.sum()])


@pytest.mark.parametrize("k1", [-0.08, 0.05, 0.0])
def test_points_go_where_the_camera_projects_them(k1: float) -> None:
    camera = Camera(BENT.K, 640, 480, np.array([k1, 0, 0, 0, 0]))
    lens = Lens(camera)
    wide, high, focal = lens.pinhole
    grid = np.array([[x, y, 1.0] for x in (-0.3, -0.15, 0, 0.2, 0.3) for y in (-0.22, 0, 0.2)])
    raw = lens.expose(blobs((high, wide), grid[:, :2] * focal + [(wide - 1) / 2, (high - 1) / 2]))
    assert raw.shape == (480, 640, 3)
    expected = camera.project(grid)
    found = np.array([centroid(raw[:, :, 0], uv) for uv in expected])
    # a spot of some pixels is itself bent a little
    assert np.sqrt(((found - expected) ** 2).sum(axis=1).mean()) < 0.04


def test_no_noise_is_no_change() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    assert add_noise(image, 0.0, np.random.default_rng(0)) is image


@pytest.mark.parametrize("sigma", [0.8, 1.5, 6.0])
def test_noise_has_the_stated_sigma(sigma: float) -> None:
    image = np.full((400, 500, 3), 128, dtype=np.uint8)
    noise = add_noise(image, sigma, np.random.default_rng(0)).astype(float) - 128
    assert abs(noise.mean()) < 0.01 * sigma
    assert noise.std() == pytest.approx(np.hypot(sigma, np.sqrt(1 / 12)), rel=0.01)


def test_noise_does_not_wrap_around() -> None:
    image = np.zeros((100, 100, 3), dtype=np.uint8)
    image[50:] = 255
    noisy = add_noise(image, 10.0, np.random.default_rng(0))
    assert noisy[:50].max() < 70
    assert noisy[50:].min() > 185


def test_noise_is_the_streams() -> None:
    image = np.full((20, 20, 3), 128, dtype=np.uint8)
    one, two, three = (add_noise(image, 2.0, np.random.default_rng(s)) for s in (1, 1, 2))
    np.testing.assert_array_equal(one, two)
    assert (one != three).any()


def test_grey_of_a_noisy_picture_is_less_noisy() -> None:
    image = np.full((300, 300, 3), 128, dtype=np.uint8)
    grey = cv2.cvtColor(add_noise(image, 3.0, np.random.default_rng(0)), cv2.COLOR_RGB2GRAY)
    assert grey.std() == pytest.approx(3.0 * np.linalg.norm([0.299, 0.587, 0.114]), rel=0.05)
