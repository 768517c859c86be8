"""Projected points: exact without noise, the same however often asked, and behind the wall."""

import numpy as np
import pytest

from aoicell.errors import TargetNotFound
from aoicell.nominal import Nominal
from aoicell.pipeline import flange_target
from aoicell.sim.cell import SimCell
from aoicell.sim.profiles import IDEAL, PAPER, TYPICAL
from aoicell.sim.projection import (
    DetectionNoise,
    PicturelessCell,
    ProjectingDetector,
    measured_noise,
)
from aoicell.sim.world import World
from aoicell.targets.chessboard import half_turn
from aoicell.targets.cross_marker import turned

NONE = DetectionNoise(0.0, 0.0)


def test_without_noise_the_points_are_those_of_the_picture(
    ideal_world: World, nominal: Nominal
) -> None:
    cell, detector = SimCell(ideal_world), ProjectingDetector(ideal_world, NONE)
    ideal_world.begin()
    view = nominal.hand_eye_start
    cell.move(flange_target(nominal, nominal.T_base_tabletarget, view, nominal.q_home))
    picture, board = cell.capture(), nominal.tabletarget
    expected, seen = detector.chessboard(picture, board, "board"), board.detect(picture.grey)
    assert min(np.abs(uv - expected).max() for uv in (seen, half_turn(seen))) < 0.05
    cell.move(flange_target(nominal, nominal.T_base_board, nominal.overview, nominal.q_home))
    picture = cell.capture()
    expected_markers = detector.markers(picture, nominal.marker)
    assert len(expected_markers) == 4
    found = nominal.marker.detect(picture.grey)
    for uv in expected_markers:
        gaps = [np.abs(turned(f, turn) - uv).max() for f in found for turn in range(4)]
        assert min(gaps) < 0.05


def test_noise_belongs_to_the_picture(ideal_world: World, nominal: Nominal) -> None:
    ideal_world.begin()
    cell = PicturelessCell(ideal_world)
    detector = ProjectingDetector(ideal_world, DetectionNoise(0.0, 0.5))
    exact = ProjectingDetector(ideal_world, NONE)
    cell.move(flange_target(nominal, nominal.T_base_board, nominal.overview, nominal.q_home))
    pictures = [cell.capture() for _ in range(150)]
    marker = nominal.marker
    once = np.array([detector.markers(picture, marker) for picture in pictures])
    again = np.array([detector.markers(picture, marker) for picture in pictures])
    np.testing.assert_array_equal(once, again)
    errors = once - np.array([exact.markers(picture, marker) for picture in pictures])
    assert errors.std() == pytest.approx(0.5, rel=0.05)
    assert abs(errors.mean()) < 0.03


def test_what_is_out_of_view_is_not_found(ideal_world: World, nominal: Nominal) -> None:
    ideal_world.begin()
    cell, detector = PicturelessCell(ideal_world), ProjectingDetector(ideal_world, NONE)
    cell.move(flange_target(nominal, nominal.T_base_board, nominal.overview, nominal.q_home))
    picture = cell.capture()
    assert picture.image.size == 0
    with pytest.raises(TargetNotFound, match="view 1: tabletarget is not completely"):
        detector.chessboard(picture, nominal.tabletarget, "view 1")


def test_the_noise_follows_sensor_and_dust() -> None:
    assert measured_noise(IDEAL) == NONE
    clean = measured_noise(TYPICAL.model_copy(update={"dust_percent": 0.0}))
    assert (clean.corner_px, clean.cross_px) == pytest.approx((0.014, 0.004))
    assert measured_noise(PAPER).corner_px > measured_noise(TYPICAL).corner_px > clean.corner_px


def test_the_pictureless_cell_shows_the_protocol_only(ideal_world: World) -> None:
    public = [name for name in dir(PicturelessCell(ideal_world)) if not name.startswith("_")]
    assert sorted(public) == ["capture", "move", "state"]
