"""Intrinsics from corners of a camera that is known."""

import numpy as np
import pytest

from aoicell.calibration.intrinsics import Intrinsics, calibrate_intrinsics
from aoicell.calibration.poses import INTRINSIC_VIEWS
from aoicell.camera import Camera
from aoicell.errors import Implausible
from aoicell.nominal import Nominal
from aoicell.targets.chessboard import half_turn
from aoicell.transforms import Array, distance_deg, distance_mm

# Nothing symmetric: fx is not fy, the centre is off differently in u and v.
TRUE = Camera(
    np.array([[2711.0, 0, 811.5], [0, 2694.0, 590.5], [0, 0, 1]]),
    1600,
    1200,
    np.array([-0.085, 0.02, 6e-4, -4e-4, 0]),
)


def corners(nominal: Nominal, noise_px: float = 0.0, seed: int = 0) -> list[Array]:
    rng, points = np.random.default_rng(seed), nominal.tabletarget.corners
    uvs = [TRUE.project(points, view.T_target_camera.inverse()) for view in INTRINSIC_VIEWS]
    return [uv + noise_px * rng.standard_normal(uv.shape) for uv in uvs]


def calibrate(nominal: Nominal, uvs: list[Array]) -> Intrinsics:
    return calibrate_intrinsics(nominal.tabletarget, uvs, nominal.cameras["hand"])


def parameters(camera: Camera) -> Array:
    K = camera.K
    return np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *camera.distortion[:4]])


@pytest.mark.parametrize("flipped", [False, True])
def test_a_known_camera_is_recovered(nominal: Nominal, flipped: bool) -> None:
    uvs = corners(nominal)
    if flipped:  # an even board reads the same after half a turn
        uvs = [half_turn(uv) if k % 2 else uv for k, uv in enumerate(uvs)]
    result = calibrate(nominal, uvs)
    gap = np.abs(parameters(result.camera) - parameters(TRUE))
    assert (gap[:4] < 0.02).all()  # px; single precision of the corners is what is left
    assert (gap[4:] < [1e-4, 2e-3, 1e-5, 1e-5]).all()
    assert result.camera.distortion[4] == 0
    assert (result.camera.width, result.camera.height) == (1600, 1200)
    assert result.rms_px < 1e-3
    assert result.view_rms_px.shape == (len(uvs),)


def test_the_views_are_where_they_were(nominal: Nominal) -> None:
    result = calibrate(nominal, corners(nominal))
    assert len(result.Ts_camera_target) == len(INTRINSIC_VIEWS)
    for view, T in zip(INTRINSIC_VIEWS, result.Ts_camera_target, strict=True):
        assert distance_mm(T, view.T_target_camera.inverse()) < 0.01
        assert distance_deg(T, view.T_target_camera.inverse()) < 0.001


def test_the_stated_deviation_is_the_real_one(nominal: Nominal) -> None:
    results = [calibrate(nominal, corners(nominal, 0.1, seed)) for seed in range(12)]
    errors = np.array([parameters(r.camera) - parameters(TRUE) for r in results])
    ratio = np.sqrt((errors**2).mean(axis=0)) / np.mean([r.std for r in results], axis=0)
    assert (ratio > 0.5).all()
    assert (ratio < 1.8).all()
    # two coordinates of 0.1 px each make up the length of a residual
    assert np.mean([r.rms_px for r in results]) == pytest.approx(0.1 * np.sqrt(2), rel=0.05)


@pytest.mark.parametrize("count", [0, 1, 5])
def test_too_few_views_are_refused(nominal: Nominal, count: int) -> None:
    with pytest.raises(Implausible, match=f"intrinsics: {count} views .* at least 6"):
        calibrate(nominal, corners(nominal)[:count])


def test_nonsense_is_refused(nominal: Nominal, rng: np.random.Generator) -> None:
    uvs = [rng.uniform(0, 1000, (48, 2)) for _ in range(8)]
    with pytest.raises(Implausible, match=r"intrinsics: reprojection error [\d.]+ px over 8 views"):
        calibrate(nominal, uvs)


def test_one_picture_of_something_else_is_noticed(nominal: Nominal) -> None:
    uvs = corners(nominal)
    uvs[3] = uvs[3].reshape(6, 8, 2).transpose(1, 0, 2).reshape(-1, 2)  # columns for rows
    with pytest.raises(Implausible, match="check the board's size and the pictures"):
        calibrate(nominal, uvs)
