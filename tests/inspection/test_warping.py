"""The new picture in the reference's pixels."""

import cv2
import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.inspection import FineRegistration
from aoicell.inspection.shown import BARE, shown_by
from aoicell.inspection.warping import Warp, on_plane
from aoicell.transforms import from_twist, translation
from inspection.flat_boards import CAMERA, T_CAMERA_BOARD, Flat, photograph

TALL = board(component("BOX", "connector", 10, -10, (40, 30, 25)), size_mm=(180, 140))


def moved(*twist: float) -> FineRegistration:
    """The board moved by a twist (m, rad) in its own frame."""
    T = T_CAMERA_BOARD * from_twist(twist)
    return FineRegistration("registered", T_CAMERA_BOARD, T, CAMERA)


def ramp(axis: int) -> np.ndarray:
    """A picture that says where it was sampled: its columns (0) or rows (1), an eighth each."""
    return np.asarray(np.mgrid[: CAMERA.height, : CAMERA.width][1 - axis] / 8, np.float32)


def test_points_of_a_plane_are_where_pixels_look() -> None:
    points = np.array([[0.03, -0.02, 0.01], [-0.05, 0.04, 0.01], [0.0, 0.0, 0.01]])
    uv = CAMERA.project(points, T_CAMERA_BOARD)
    np.testing.assert_allclose(on_plane(uv, 0.01, CAMERA, T_CAMERA_BOARD), points, atol=1e-8)


def test_nothing_moved_changes_nothing(flat: Flat) -> None:
    shown = shown_by(flat.board, CAMERA, T_CAMERA_BOARD)
    image = flat.reference.images[0]
    warped = Warp(CAMERA, T_CAMERA_BOARD, shown)(image, moved(0, 0, 0, 0, 0, 0))
    inner = (slice(5, -5), slice(5, -5))
    assert np.abs(warped[inner] - image[inner]).max() < 0.5


@pytest.mark.parametrize(
    "twist",
    [(2e-3, 0, 0, 0, 0, 0), (0, -2e-3, 3e-3, 0, 0, 0), (1e-3, 0, 0, 0.01, -0.02, 0.03)],
)
def test_each_height_is_sampled_where_it_is(twist: tuple[float, ...]) -> None:
    """To a tenth of a pixel: on the laminate and on top of a part 25 mm high."""
    shown = shown_by(TALL, CAMERA, T_CAMERA_BOARD)
    warp, registration = Warp(CAMERA, T_CAMERA_BOARD, shown), moved(*twist)
    sampled = [warp(ramp(axis), registration) * 8 for axis in (0, 1)]
    top = (shown.numbers == 0) & shown.tops
    for height, area in ((0.0, shown.numbers == BARE), (25e-3, top)):
        rows, columns = (indices[::997] for indices in np.nonzero(area))
        uv = np.column_stack([columns, rows]).astype(float)
        points = on_plane(uv, height, CAMERA, T_CAMERA_BOARD)
        expected = registration.project(points)
        found = np.column_stack([plane[rows, columns] for plane in sampled])
        inside = np.isfinite(found).all(axis=1) & (
            (expected > 3) & (expected < [CAMERA.width - 4, CAMERA.height - 4])
        ).all(axis=1)
        assert inside.sum() > 30
        assert np.linalg.norm((found - expected)[inside], axis=1).max() < 0.15


def test_a_moved_board_looks_as_before(flat: Flat) -> None:
    """The wrong way round, it would differ by twice the motion."""
    shown = shown_by(flat.board, CAMERA, T_CAMERA_BOARD)
    twist = (1.5e-3, -1e-3, 0, 0, 0, 0.01)
    new = photograph(flat.plane, T_CAMERA_BOARD * from_twist(twist), seed=2)
    warped = Warp(CAMERA, T_CAMERA_BOARD, shown)(new, moved(*twist))
    old = flat.reference.images[0].astype(np.float32)
    known = np.isfinite(warped) & (shown.numbers != -3)
    before = np.abs(new[known].astype(float) - old[known]).mean()
    after = np.abs(warped[known] - old[known]).mean()
    assert after < 0.25 * before
    assert after < 1.5


def test_what_the_picture_does_not_reach_is_unknown(flat: Flat) -> None:
    shown = shown_by(flat.board, CAMERA, T_CAMERA_BOARD)
    T = translation(0.01) * T_CAMERA_BOARD  # 50 px to the right in the picture
    registration = FineRegistration("registered", T_CAMERA_BOARD, T, CAMERA)
    warped = Warp(CAMERA, T_CAMERA_BOARD, shown)(flat.reference.images[0], registration)
    unknown = np.isnan(warped)
    assert unknown[:, -30:].all()
    assert not unknown[100:-100, 100:-100].any()
    area = cv2.countNonZero(unknown.astype(np.uint8)) / unknown.size
    assert area == pytest.approx(50 / CAMERA.width, rel=0.5)
