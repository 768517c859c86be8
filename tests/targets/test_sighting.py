"""Sightings that fix no pose are refused with what was seen; frames are where they should be."""

import numpy as np
import pytest

from aoicell.errors import TargetNotFound
from aoicell.targets.apriltag import AprilTag
from aoicell.targets.aruco_grid import ArucoGrid
from aoicell.targets.charuco import Charuco
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.circle_grid import CircleGrid
from aoicell.targets.sighting import CalibrationTarget, Sighting, complete, enough
from aoicell.transforms import apply

ALL: list[CalibrationTarget] = [
    Chessboard(8, 6, 0.02), Chessboard(7, 6, 0.02), Charuco(5, 7, 0.03, 0.02),
    ArucoGrid(4, 3, 0.03, 0.01), CircleGrid(7, 5, 0.02), CircleGrid(6, 6, 0.02, origin_dot=True),
    CircleGrid(4, 11, 0.02, asymmetric=True), CircleGrid(4, 10, 0.02, asymmetric=True),
    AprilTag(0.05), AprilTag(0.03, columns=3, rows=2, gap=0.01),
]  # fmt: skip
POINTS = Chessboard(5, 4, 0.01).points


def name_of(target: CalibrationTarget) -> str:
    return f"{type(target).__name__} of {len(target.points)}"


@pytest.mark.parametrize("target", ALL, ids=name_of)
def test_frames_are_flat_and_central(target: CalibrationTarget) -> None:
    low, high = target.points.min(axis=0), target.points.max(axis=0)
    np.testing.assert_allclose((low + high)[:2], 0, atol=1e-12)
    assert (target.points[:, 2] == 0).all()


@pytest.mark.parametrize("target", [t for t in ALL if t.half_turns], ids=name_of)
def test_a_half_turn_swaps_the_first_and_the_last_point(target: CalibrationTarget) -> None:
    np.testing.assert_allclose(target.points[::-1], -target.points, atol=1e-12)


@pytest.mark.parametrize("target", ALL, ids=name_of)
def test_opencvs_frame_has_z_into_the_print_and_the_points_below_its_origin(
    target: CalibrationTarget,
) -> None:
    T = target.T_target_opencv
    np.testing.assert_allclose(T.rotation, np.diag([1, -1, -1]))
    if not isinstance(target, AprilTag) or len(target.points) > 4:
        assert (apply(T.inverse(), target.points)[:, :2] >= -1e-12).all()


def test_enough_points_pass() -> None:
    seen = complete(np.zeros((20, 2)))
    assert enough(seen, POINTS, 6, "20 of 20 points", "board") is seen


def test_too_few_are_named() -> None:
    seen = Sighting(np.arange(3), np.zeros((3, 2)))
    with pytest.raises(TargetNotFound, match="view 4: 3 of 20 corners, at least 6 are needed; "):
        enough(seen, POINTS, 6, "3 of 20 corners, at least 6 are needed", "view 4")


@pytest.mark.parametrize("ids", [np.arange(5), np.arange(0, 20, 5), np.array([0, 6, 12, 18])])
def test_points_in_one_row_fix_no_pose(ids: np.ndarray) -> None:
    with pytest.raises(TargetNotFound, match=f"all {len(ids)} points .* in one row"):
        enough(Sighting(ids, np.zeros((len(ids), 2))), POINTS, 4, "", "board")
