"""The camera model against Brown's formula, written out on its own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.camera import Camera
from aoicell.transforms import SE3, Array, looking_at, translation

K = np.array([[1400.0, 0, 790.0], [0, 1410.0, 610.0], [0, 0, 1]])
BENT = np.array([-0.08, 0.02, 1e-3, -2e-3, 0.01])


def brown(ps: Array, K: Array, distortion: Array) -> Array:
    """Pixels by the textbook formula."""
    k1, k2, p1, p2, k3 = distortion
    x, y = ps[:, 0] / ps[:, 2], ps[:, 1] / ps[:, 2]
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    yd = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.column_stack([K[0, 0] * xd + K[0, 2], K[1, 1] * yd + K[1, 2]])


@pytest.fixture
def bent() -> Camera:
    return Camera(K, 1600, 1200, BENT)


def test_project_is_browns_model(bent: Camera, rng: np.random.Generator) -> None:
    ps = rng.uniform([-0.3, -0.2, 0.5], [0.3, 0.2, 1.0], (200, 3))
    np.testing.assert_allclose(bent.project(ps), brown(ps, K, BENT), atol=1e-9)


def test_project_takes_the_pose_of_the_points_frame(bent: Camera) -> None:
    T_camera_target = looking_at([0.01, 0.02, 0], 0.5, (0.2, -0.1), 0.3).inverse()
    p_target = np.array([[0.03, -0.02, 0.001]])
    expected = brown(T_camera_target.act(p_target[0])[None], K, BENT)
    np.testing.assert_allclose(bent.project(p_target, T_camera_target), expected, atol=1e-9)


def test_the_principal_point_of_a_pinhole_is_the_middle_of_the_pixel_centres() -> None:
    camera = Camera.pinhole(1000.0, 1600, 1200)
    np.testing.assert_allclose(camera.project([[0, 0, 1]]), [[799.5, 599.5]])
    # a point to the right and below of the axis goes to larger u and v
    np.testing.assert_allclose(camera.project([[0.1, 0.2, 1]]), [[899.5, 799.5]])
    assert camera.focal_px == 1000.0


@given(st.floats(0, 1599), st.floats(0, 1199), st.floats(-0.1, 0.1), st.floats(-0.02, 0.02))
def test_unproject_inverts_project(u: float, v: float, k1: float, k2: float) -> None:
    camera = Camera(K, 1600, 1200, np.array([k1, k2, 1e-3, -5e-4, 0]))
    xy = camera.unproject([[u, v]])
    uv = camera.project(np.column_stack([xy, np.ones(1)]))
    assert np.abs(uv - [u, v]).max() < 1e-6


def test_undistort_shows_what_the_pinhole_would(bent: Camera) -> None:
    ps = np.array([[0.2, -0.1, 1.0], [-0.3, 0.2, 1.0]])
    straight = brown(ps, K, np.zeros(5))
    np.testing.assert_allclose(bent.undistort(bent.project(ps)), straight, atol=1e-6)


def test_barrel_distortion_draws_points_inwards() -> None:
    camera = Camera(K, 1600, 1200, np.array([-0.08, 0, 0, 0, 0]))
    u = camera.project([[0.4, 0, 1]])[0, 0]
    assert u < 790 + 1400 * 0.4


@pytest.mark.parametrize(
    ("point", "seen"),
    [
        ((0, 0, 1), True),
        ((0, 0, -1), False),
        ((0.79, 0, 1), True),
        ((0.81, 0, 1), False),
        ((0, -0.59, 1), True),
        ((0, -0.61, 1), False),
    ],
)
def test_sees_what_is_in_front_and_in_the_picture(
    point: tuple[float, float, float], seen: bool
) -> None:
    camera = Camera.pinhole(1000.0, 1600, 1200)
    assert camera.sees([point], SE3.Identity()) is seen
    assert camera.sees([(0, 0, 1), point], SE3.Identity()) is seen


def test_sees_keeps_a_margin_and_uses_the_pose() -> None:
    camera = Camera.pinhole(1000.0, 1600, 1200)
    assert camera.sees([[0.79, 0, 1]], SE3.Identity(), margin_px=5)
    assert not camera.sees([[0.79, 0, 1]], SE3.Identity(), margin_px=15)
    assert not camera.sees([[0.79, 0, 1]], translation(x=0.1))
    assert camera.sees([[0.79, 0, 1]], translation(x=-0.1), margin_px=15)


def test_a_camera_cannot_be_altered(bent: Camera) -> None:
    with pytest.raises(ValueError, match="read-only"):
        bent.K[0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        bent.distortion[0] = 1


def test_a_camera_keeps_no_hold_of_the_callers_array() -> None:
    mine = K.copy()
    camera = Camera(mine, 1600, 1200)
    mine[:] = 0
    assert camera.K[0, 0] == 1400.0
