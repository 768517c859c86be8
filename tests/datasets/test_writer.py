"""A recording that is written reads back the same."""

from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.datasets.manifest import PoseFormat, load_manifest
from aoicell.datasets.pictures import read_picture
from aoicell.datasets.recording import read_recording
from aoicell.datasets.target_descriptions import CharucoDescription, ChessboardDescription
from aoicell.datasets.writer import to_toml, write_recording
from aoicell.errors import InputError

from .robots import arm_and_target_poses

ARMS, _ = arm_and_target_poses()
BOARD = ChessboardDescription(kind="chessboard", columns=8, rows=6, square_mm=15.0)
CODED = CharucoDescription(
    kind="charuco", name="second", mount="eye_to_hand", columns=5, rows=7, square_mm=30.0,
    marker_mm=20.0, dictionary="DICT_5X5_100",
)  # fmt: skip
CAMERA = Camera(
    np.array([[50.0, 0, 31.5], [0, 51.0, 23.5], [0, 0, 1]]), 64, 48, np.array([0.1, 0, 0, 0, 0.2])
)


@pytest.mark.parametrize("pose_format", get_args(PoseFormat))
def test_a_recording_goes_round(
    tmp_path: Path, rng: np.random.Generator, pose_format: PoseFormat
) -> None:
    images = rng.integers(0, 255, (len(ARMS), 48, 64, 3), dtype=np.uint8)
    views = [(f"v{k}", image, T) for k, (image, T) in enumerate(zip(images, ARMS, strict=True))]
    path = write_recording(
        tmp_path / "new", "eye_in_hand", [BOARD, CODED], views, CAMERA, pose_format
    )
    recording = read_recording(path)
    assert recording.warnings == ()
    assert [view.id for view in recording.views] == [f"v{k}" for k in range(len(ARMS))]
    for view, image, T in zip(recording.views, images, ARMS, strict=True):
        assert np.abs(view.T_base_flange.homogeneous - T.homogeneous).max() < 1e-12
        assert view.picture is not None
        np.testing.assert_array_equal(read_picture(view.picture), image)
    (camera,) = recording.cameras
    assert camera.refine
    assert camera.intrinsics is not None
    np.testing.assert_array_equal(camera.intrinsics.K, CAMERA.K)
    np.testing.assert_array_equal(camera.intrinsics.distortion, CAMERA.distortion)
    assert [target.mount for target in recording.targets] == ["eye_in_hand", "eye_to_hand"]
    assert recording.targets[0].model_copy(update={"camera": None, "mount": None}) == BOARD


def test_a_manifest_goes_round(tmp_path: Path) -> None:
    image = np.zeros((48, 64), np.uint8)
    path = write_recording(tmp_path / "new", "eye_in_hand", [CODED], [("1", image, ARMS[0])])
    manifest = load_manifest(path)
    (tmp_path / "again.toml").write_text(to_toml(manifest))
    assert load_manifest(tmp_path / "again.toml") == manifest
    assert manifest.cameras[0].intrinsics is None


@pytest.mark.parametrize("ids", [["a", "a"], [""], ["a/b"], [".."], ["a b"]])
def test_ids_are_plain_names(tmp_path: Path, ids: list[str]) -> None:
    views = [(id, np.zeros((4, 4), np.uint8), ARMS[0]) for id in ids]
    with pytest.raises(InputError, match="stands twice or is no plain name"):
        write_recording(tmp_path / "new", "eye_in_hand", [BOARD], views)


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "mine").touch()
    with pytest.raises(InputError, match="not empty; name a new folder"):
        write_recording(tmp_path, "eye_in_hand", [BOARD], [])
