"""Recordings of real robots, which are not part of the project: AOICELL_DATASETS names a folder.

See the issue tracker of each source; the folder's README gives what is known about them.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from aoicell.datasets.recording import Recording, read_recording
from aoicell.datasets.suggest import suggest

from .robots import write_manifest

FOLDER = os.environ.get("AOICELL_DATASETS", "")
pytestmark = pytest.mark.skipif(
    not FOLDER, reason="AOICELL_DATASETS names no folder with recordings of real robots"
)

PICTURES = """mount = "{mount}"
[[target]]
{target}
[views]
images = "{folder}/images/*.png"
poses = "{folder}/poses/*.yaml"
pose_format = "named_quat"
pose_meaning = "T_base_flange"
length_unit = "m"
pairing = "name"
[camera]
intrinsics = "{folder}/camera_intr.yaml"
refine = true
"""
CIRCLES = 'kind = "circle_grid"\ncolumns = 10\nrows = 10\nspacing_mm = 25.4\norigin_dot = true'
CHARUCO = (
    'kind = "charuco"\ncolumns = 5\nrows = 7\nsquare_mm = 36.195\nmarker_mm = 18.256\n'
    'dictionary = "DICT_6X6_250"'
)
PAIRS = """mount = "{mount}"
[views]
pairs = "{folder}/pose_samples.json"
pair_format = "json_effector_and_object"
pose_meaning = "T_base_flange"
length_unit = "m"
"""


def manifest(tmp_path: Path, text: str, name: str, **values: str) -> Path:
    folder = Path(FOLDER).resolve() / name
    return write_manifest(tmp_path, text.format(folder=folder, **values))


def check_views(recording: Recording, count: int, size: tuple[int, int]) -> None:
    assert [view.id for view in recording.views] == [str(k) for k in range(count)]
    assert not any(picture.problem for view in recording.views for picture in view.pictures)
    assert recording.cameras[0].size == size
    assert recording.warnings == ()


def test_abb_circle_grid(tmp_path: Path) -> None:
    path = manifest(tmp_path, PICTURES, "abb_circle_grid", mount="eye_in_hand", target=CIRCLES)
    recording = read_recording(path)
    check_views(recording, 15, (640, 480))
    camera = recording.cameras[0].intrinsics
    assert camera is not None
    assert (camera.K[0, 0], camera.K[0, 2], camera.K[1, 2]) == (550, 320, 240)
    np.testing.assert_allclose(recording.views[0].T_base_flange.translation,
                               [0.7169496, 0.0033035, 0.8533135], atol=1e-7)  # fmt: skip
    wrist_z = recording.views[0].T_base_flange.rotation[:, 2]
    assert wrist_z[2] < -0.99  # the camera in its hand looks down


def test_abb_charuco(tmp_path: Path) -> None:
    path = manifest(tmp_path, PICTURES, "abb_charuco", mount="eye_to_hand", target=CHARUCO)
    recording = read_recording(path)
    check_views(recording, 16, (1600, 1200))
    # keys stand in another order in each file
    np.testing.assert_allclose(recording.views[0].T_base_flange.translation,
                               [0.1130742, 0.5892803, 0.6526738], atol=1e-7)  # fmt: skip


def test_moveit_pose_pairs_are_eye_to_hand(tmp_path: Path) -> None:
    path = manifest(tmp_path, PAIRS, "moveit_pose_pairs", mount="eye_in_hand")
    recording = read_recording(path)
    assert len(recording.views) == 50
    assert all(view.T_camera_target is not None for view in recording.views)
    readings = suggest(path)
    assert readings[0].changes == ('mount = "eye_to_hand"',)
    assert readings[0].scatter_mm == pytest.approx(4.6, abs=0.1)
    as_it_stands = next(reading for reading in readings if not reading.changes)
    assert as_it_stands.scatter_mm > 200
