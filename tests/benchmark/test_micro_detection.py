"""The detection benchmark runs and reports what it promises."""

import json

import cv2
import numpy as np
import pytest

from aoicell.benchmark.micro import BENCHMARKS, detection
from aoicell.nominal import Nominal
from aoicell.observation import Image


@pytest.fixture
def one_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """One of the tripod's pictures: what a test has time for."""
    monkeypatch.setattr(detection, "SETUP_MOTIONS", detection.SETUP_MOTIONS[:1])
    monkeypatch.setattr(detection, "QUICK_ROUNDS", 2)


@pytest.mark.usefixtures("one_picture")
def test_detection_is_measured_against_opencv_on_the_same_picture() -> None:
    threads = cv2.getNumThreads()
    result = BENCHMARKS["detection"](True)
    assert cv2.getNumThreads() == threads
    assert json.loads(json.dumps(result)) == result
    assert result["name"] == "detection"
    (row,) = result["rows"]
    assert row["ms"] > 0
    assert row["opencv_ms"] > 0
    assert row["rms_px"] < 0.06
    assert row["rms_px"] < row["opencv_rms_px"]
    assert result["ratios"]["over_opencv"] == pytest.approx(row["over_opencv"])
    assert result["ratios"]["two_boards_ms"] == pytest.approx(row["ms"], abs=0.02)


def test_a_picture_in_which_opencv_finds_nothing_has_no_figure(nominal: Nominal) -> None:
    blank: Image = np.full((300, 400), 128, dtype=np.uint8)
    found = detection._by_opencv(nominal.tabletarget, blank)
    assert found is None
    corners = nominal.tabletarget.corners[:, :2]
    assert detection._rms_px(found, (corners, corners)) is None
