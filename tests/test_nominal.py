"""The shipped cell is read as it is written, and a broken folder is named."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from aoicell.errors import ModelError
from aoicell.nominal import Nominal, View, load_chessboard, load_nominal
from aoicell.resources import data_root


def test_poses_come_in_metres_and_radians(nominal: Nominal) -> None:
    np.testing.assert_allclose(nominal.T_flange_camera.translation, [0, 0, 0.05])
    np.testing.assert_allclose(nominal.T_base_tabletarget.translation, [-0.35, 0.85, 0.402])
    # image x of the table's chessboard runs along base y
    np.testing.assert_allclose(nominal.T_base_tabletarget.rotation[:, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(np.degrees(nominal.q_home), [20, -8, -23, 0, -59, -68])


def test_chessboard_1_faces_backwards(nominal: Nominal) -> None:
    np.testing.assert_allclose(nominal.T_flange_armtarget.rotation[:, 2], [0, 0, -1], atol=1e-12)


def test_the_boards_cannot_be_confused(nominal: Nominal) -> None:
    assert nominal.armtarget.square != nominal.tabletarget.square
    for board in (nominal.armtarget, nominal.tabletarget):
        assert (board.columns, board.rows) == (8, 6)


def test_the_cameras_are_centred_and_straight(nominal: Nominal) -> None:
    hand = nominal.cameras["hand"]
    assert (hand.width, hand.height, hand.focal_px) == (1600, 1200, 2667.0)
    np.testing.assert_array_equal(hand.K[:2, 2], [799.5, 599.5])
    assert not hand.distortion.any()


def test_views(nominal: Nominal) -> None:
    assert nominal.check.distance == 0.5
    assert nominal.check.roll == pytest.approx(np.radians(7))
    assert [view.id for view in nominal.inspection_views] == ["V1", "V2", "V3", "V4"]
    first = nominal.inspection_views[0]
    assert first.aim == pytest.approx((0.095, 0.078, 0))
    assert first.tilt == pytest.approx(np.radians([8, -6]))


def test_a_view_looks_from_the_front() -> None:
    T = View("v", 0.5, aim=(0.1, 0.2, 0)).T_target_camera
    np.testing.assert_allclose(T.translation, [0.1, 0.2, 0.5])
    np.testing.assert_allclose(T.rotation[:, 2], [0, 0, -1], atol=1e-12)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the cell, free to be broken; the models stay where they are."""
    source = data_root()
    (tmp_path / "models").symlink_to(source / "models")
    shutil.copytree(source / "cell", tmp_path / "cell")
    return tmp_path / "cell"


def replace(folder: Path, old: str, new: str) -> None:
    file = folder / "nominal.toml"
    text = file.read_text()
    assert old in text, f"{old!r} is gone from nominal.toml: change this test"
    file.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("T_base_board =", "T_bse_board =", r"poses.T_base_board.*did you mean 'T_bse_board'"),
        ("arm = ", "rm = ", r"models.arm' is missing"),
        ("[setup]", "[set_up]", r"setup.T_base_flange"),
        ("[check]\ndistance_mm = 500", "[check]\ndistance_mm = 'far'", r"check.distance_mm"),
        ("xyz_mm = [0, 0, 50]", "xyz_mm = [0, 50]", r"T_flange_camera.xyz_mm.*3 numbers"),
        ('"../models/camera"', '"../models/camra"', r"camra.camera.toml: no such file"),
        ('"../models/ra620_1621"', '"../models/chessboard"', r"chessboard: holds 0 URDF files"),
        ("home_deg = [20.0,", "home_deg = [", r"home_deg.*6 numbers"),
    ],
)
def test_what_is_wrong_is_named(folder: Path, old: str, new: str, says: str) -> None:
    replace(folder, old, new)
    with pytest.raises(ModelError, match=says):
        load_nominal(folder)


def test_an_absent_folder(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"nowhere.nominal.toml: no such file"):
        load_nominal(tmp_path / "nowhere")


def test_a_chessboards_file(tmp_path: Path) -> None:
    file = tmp_path / "b.toml"
    file.write_text("columns = 5\nrows = 4\nsquare_mm = 30.0\nmargin_mm = 3.0\n")
    board = load_chessboard(file)
    assert (board.columns, board.rows) == (5, 4)
    assert (board.square, board.margin) == pytest.approx((0.03, 0.003))
    file.write_text("columns = 5\nrows = 4\nmargin_mm = 3.0\n")
    with pytest.raises(ModelError, match="square_mm' is missing"):
        load_chessboard(file)
