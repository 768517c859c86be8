"""The virtual touch test: exact in an exact cell, and as far off as a calibration that is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.benchmark.micro import touch
from aoicell.benchmark.micro.touch import LEANS, TIP, Touches, touch_points, touch_world
from aoicell.nominal import Nominal
from aoicell.pipeline import Calibration
from aoicell.transforms import apply, from_xyz_rpy


def test_an_ideal_cell_is_touched_exactly(nominal: Nominal) -> None:
    touches = touch_world(nominal, "ideal", 0)
    assert set(touches) == {"paper", "aoicell"}
    for touched in touches.values():
        assert not touched.refused
        assert len(touched.distances_mm) == touch.POINTS
        assert max(touched.distances_mm) < 0.01


def test_a_wrong_hand_eye_shows_in_full(nominal: Nominal, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing cancels: what the camera is misplaced by is what the tip is off by."""
    calibrate = touch.calibrate

    def misplaced(*args: object) -> dict[str, Calibration]:
        calibrations = calibrate(*args)  # type: ignore[arg-type]
        for name, c in calibrations.items():
            T = c.hand_eye.T_flange_camera * from_xyz_rpy([0.002, 0, 0], [0, 0, 0])
            calibrations[name] = replace(c, hand_eye=replace(c.hand_eye, T_flange_camera=T))
        return calibrations

    monkeypatch.setattr(touch, "calibrate", misplaced)
    for touched in touch_world(nominal, "ideal", 0).values():
        assert np.mean(touched.distances_mm) == pytest.approx(2.0, abs=0.05)


def test_points_are_spread_over_the_board(nominal: Nominal) -> None:
    points = touch_points(nominal)
    tops = np.array([[c.x, c.y, c.top] for c in nominal.board.components])
    assert len(np.unique(points, axis=0)) == touch.POINTS
    assert (np.ptp(points[:, :2], axis=0) > 0.9 * np.ptp(tops[:, :2], axis=0)).all()
    assert len(LEANS) < touch.POINTS  # every lean is used
    assert TIP[2] > apply(nominal.T_flange_camera, np.zeros(3))[2]


def test_a_refusal_is_counted_and_no_distance(monkeypatch: pytest.MonkeyPatch) -> None:
    def worlds(nominal: Nominal, profile: str, index: int) -> dict[str, Touches]:
        declined = index == 0 and profile == "paper"
        ours = Touches((), "out of reach") if declined else Touches((1.0, 3.0))
        return {"paper": Touches((4.0, 6.0)), "aoicell": ours}

    monkeypatch.setattr(touch, "touch_world", worlds)
    result = touch.bench_touch(quick=True)
    rows = {(row["profile"], row["method"]): row for row in result["rows"]}
    assert (rows["paper", "aoicell"]["refused"], rows["paper", "aoicell"]["touches"]) == (1, 4)
    assert rows["typical", "paper"]["mean_mm"] == 5
    assert rows["typical", "aoicell"]["max_mm"] == 3
    assert result["ratios"]["paper_over_aoicell_typical"] == 2.5
    assert result["ratios"]["aoicell_typical_mm"] == 2
