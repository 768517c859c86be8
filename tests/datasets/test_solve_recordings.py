"""Recordings of real robots, calibrated: AOICELL_DATASETS names a folder with them."""

from pathlib import Path

import numpy as np
import pytest

from aoicell.datasets.describe import describe
from aoicell.datasets.recording import read_recording
from aoicell.datasets.solve import solve_recording

from .test_recordings import CHARUCO, CIRCLES, FOLDER, PAIRS, PICTURES, manifest

pytestmark = pytest.mark.skipif(
    not FOLDER, reason="AOICELL_DATASETS names no folder with recordings of real robots"
)


def test_abb_circle_grid_has_another_spacing_than_its_file_says(tmp_path: Path) -> None:
    """The arm's motion fits 24.82 +/- 0.03 mm, the file says 25.4."""
    path = manifest(tmp_path, PICTURES, "abb_circle_grid", mount="eye_in_hand", target=CIRCLES)
    values = describe(solve_recording(read_recording(path)))
    spacing_mm, std_mm = 25.4 * values["target_scale"], 25.4 * values["target_scale_std"]
    assert spacing_mm == pytest.approx(24.82, abs=0.03)
    assert std_mm < 0.1
    assert values["verdict"] == "suspect"
    assert any("measure the print" in reason for reason in values["reasons"])
    assert all(view["used"] for view in values["views"])


def test_abb_charuco_with_its_own_distortion(tmp_path: Path) -> None:
    path = manifest(tmp_path, PICTURES, "abb_charuco", mount="eye_to_hand", target=CHARUCO)
    values = describe(solve_recording(read_recording(path)))
    assert values["rms_px"] < 1.25
    assert values["holdout_px"] < 1.5
    assert values["scatter_mm"] < 1.9  # 9.6 mm with the supplied intrinsics
    assert abs(values["camera"]["distortion"][0]) > 0.01
    assert any("intrinsics to start from are up to" in text for text in values["warnings"])
    assert "T_base_camera" in values


def test_moveit_pose_pairs_place_the_camera(tmp_path: Path) -> None:
    path = manifest(tmp_path, PAIRS, "moveit_pose_pairs", mount="eye_to_hand")
    values = describe(solve_recording(read_recording(path)))
    place = np.array(values["T_base_camera"]["matrix"])[:3, 3]
    assert np.linalg.norm(place - [0.659, -0.250, 0.830]) < 2e-3
    assert values["scatter_mm"] == pytest.approx(4.6, abs=0.2)
    assert values["verdict"] in ("ok", "suspect")


def test_moveit_pose_pairs_as_eye_in_hand_are_refused(tmp_path: Path) -> None:
    path = manifest(tmp_path, PAIRS, "moveit_pose_pairs", mount="eye_in_hand")
    values = describe(solve_recording(read_recording(path)))
    assert values["verdict"] == "refused"
    assert "convention" in values["reasons"][0]
    assert values["T_flange_camera"] is None
