"""Targets in pictures of real robots: AOICELL_DATASETS names the folder of the recordings."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from aoicell.observation import Image
from aoicell.targets.charuco import Charuco
from aoicell.targets.circle_grid import CircleGrid
from aoicell.targets.sighting import CalibrationTarget, Sighting
from aoicell.transforms import Array

DATASETS = os.environ.get("AOICELL_DATASETS")
pytestmark = pytest.mark.skipif(
    DATASETS is None, reason="AOICELL_DATASETS (a folder of recordings) is not set"
)


def pictures(recording: str) -> list[Image]:
    files = sorted(
        (Path(DATASETS or "") / recording / "images").glob("*.png"), key=lambda f: int(f.stem)
    )
    assert files
    return [np.asarray(cv2.imread(str(f), cv2.IMREAD_GRAYSCALE), dtype=np.uint8) for f in files]


def apart(seen: Sighting, target: CalibrationTarget) -> Array:
    """Distances from the plane's best image without a lens (px)."""
    points = target.points[seen.ids][:, :2]
    H, _ = cv2.findHomography(points, seen.uv_px)
    fitted = cv2.perspectiveTransform(points[None], H)[0]
    return np.linalg.norm(fitted - seen.uv_px, axis=1)


def test_all_views_of_the_circle_grid_are_found() -> None:
    grid = CircleGrid(10, 10, 0.0254, origin_dot=True)
    seen = [grid.sight(grey) for grey in pictures("abb_circle_grid")]
    assert len(seen) == 15
    assert min(len(s.ids) for s in seen) >= 90
    # the arm hardly turns the camera about its axis: the large dot stays lower left
    for s in seen:
        u, v = s.uv_px[np.searchsorted(s.ids, [80, 81, 70])].T
        assert u[1] > u[0]
        assert v[2] < v[0]
        assert np.sqrt((apart(s, grid) ** 2).mean()) < 0.6


def test_all_views_of_the_charuco_board_give_most_corners() -> None:
    board = Charuco(5, 7, 0.036195, 0.018256)
    seen = [board.sight(grey) for grey in pictures("abb_charuco")]
    assert len(seen) == 16
    assert min(len(s.ids) for s in seen) >= 20
    for s in seen:
        assert np.sqrt((apart(s, board) ** 2).mean()) < 1.0  # the lens bends these pictures
