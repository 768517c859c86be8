"""Fine registration: known motions are recovered; what cannot be registered is said to be so."""

import numpy as np
import pytest

from aoicell.inspection import FineRegistration, InspectionConfig, Reference, register_2d
from aoicell.inspection.registration import RegistrationConfig
from aoicell.nominal import Nominal
from aoicell.transforms import SE3, from_twist, translation
from inspection.flat_boards import CAMERA, T_CAMERA_BOARD, Flat, photograph
from inspection.scenes import Look, Scene

MOTIONS = (
    (1.5e-3, 0, 0, 0, 0, 0), (0, -2e-3, 0, 0, 0, 0), (0, 0, 4e-3, 0, 0, 0),
    (0, 0, 0, 0, 0, 0.02), (0, 0, 0, 0.01, -0.008, 0),
    (-2e-3, 1e-3, 1e-3, -4e-3, 5e-3, -0.01),
)  # fmt: skip


def flat_error_px(registration: FineRegistration, T_camera_board: SE3, flat: Flat) -> float:
    """The worst error over the flat board's parts."""
    T = registration.T_camera_board * registration.T_camera_reference.inverse()
    tops = np.array([[c.x, c.y, c.top] for c in flat.board.components])
    carried = CAMERA.project(tops, T * T_CAMERA_BOARD)
    return float(np.linalg.norm(carried - CAMERA.project(tops, T_camera_board), axis=1).max())


def test_the_same_picture_does_not_move(flat: Flat) -> None:
    registration = register_2d(flat.reference.images[0], flat.reference, flat.board)
    assert registration.state == "registered"
    assert registration.moved_px < 0.05
    assert flat_error_px(registration, T_CAMERA_BOARD, flat) < 0.05


@pytest.mark.parametrize("twist", MOTIONS)
def test_a_known_motion_is_recovered(flat: Flat, twist: tuple[float, ...]) -> None:
    """Each axis by itself, and all at once."""
    T = T_CAMERA_BOARD * from_twist(twist)
    registration = register_2d(photograph(flat.plane, T, seed=1), flat.reference, flat.board)
    assert registration.state == "registered"
    assert registration.moved_px > 0.3
    error_px = flat_error_px(registration, T, flat)
    assert error_px < 0.15
    assert error_px < 2 * registration.error_px, "it knows how far it may be off"


def test_gain_and_offset_move_nothing(flat: Flat) -> None:
    for light in (0.7, 1.4):
        new = photograph(flat.plane, seed=2, light=light)
        registration = register_2d(new, flat.reference, flat.board)
        assert registration.state == "registered"
        assert flat_error_px(registration, T_CAMERA_BOARD, flat) < 0.15


def test_another_camera_is_taken_into_account(flat: Flat) -> None:
    """The picture is of the reference's camera: another one has to explain it by a motion."""
    own = register_2d(flat.reference.images[0], flat.reference, flat.board, camera=CAMERA)
    assert own.moved_px < 0.05
    K = CAMERA.K.copy()
    K[0, 2] += 3
    other = type(CAMERA)(K, CAMERA.width, CAMERA.height, CAMERA.distortion)
    seen = register_2d(flat.reference.images[0], flat.reference, flat.board, camera=other)
    moved = seen.T_camera_board.translation - seen.T_camera_reference.translation
    assert seen.camera is other
    assert moved[0] == pytest.approx(-3 / K[0, 0] * T_CAMERA_BOARD.translation[2], rel=0.3)


def test_a_board_beyond_the_limit_gets_no_verdict(flat: Flat) -> None:
    config = InspectionConfig(registration=RegistrationConfig(max_moved_px=8))
    new = photograph(flat.plane, T_CAMERA_BOARD * translation(3e-3))
    registration = register_2d(new, flat.reference, flat.board, config)
    assert registration.state == "no_verdict"
    assert "15 px off, 8 px are accepted" in registration.reason


@pytest.mark.parametrize("grey", [0, 128, 255])
def test_an_empty_picture_gets_no_verdict(flat: Flat, grey: int) -> None:
    empty = np.full_like(flat.reference.images[0], grey)
    registration = register_2d(empty, flat.reference, flat.board)
    assert registration.state == "no_verdict"
    assert registration.reason


def test_an_empty_reference_gets_no_verdict(flat: Flat) -> None:
    empty = np.full_like(flat.reference.images[0], 90)
    reference = Reference("empty", (empty,), T_CAMERA_BOARD, CAMERA)
    for new in (empty, flat.reference.images[0]):
        registration = register_2d(new, reference, flat.board)
        assert registration.state == "no_verdict"
        assert registration.reason


def test_noise_gets_no_verdict(flat: Flat, rng: np.random.Generator) -> None:
    noise = rng.integers(0, 256, flat.reference.images[0].shape).astype(np.uint8)
    assert register_2d(noise, flat.reference, flat.board).state == "no_verdict"


# ---- in the cell -------------------------------------------------------------------------------


def test_a_moved_camera_registers_to_the_truth(
    scene: Scene, taught: Look, spoilt: Look, reference: Reference, nominal: Nominal
) -> None:
    """With tall parts in view, another board under it, and defects on that."""
    registration = register_2d(spoilt.grey, reference, nominal.board)
    assert registration.state == "registered"
    assert registration.moved_px > 5
    assert np.median(scene.error_px(registration, taught, spoilt)) < 0.2
    assert scene.error_px(registration, taught, spoilt).max() < 0.3
