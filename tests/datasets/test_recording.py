"""Recordings on disk: what belongs together, and what does not."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

from aoicell.datasets.pose_writer import write_poses
from aoicell.datasets.recording import Recording, read_recording
from aoicell.errors import InputError
from aoicell.transforms import SE3

from .robots import MANIFEST, arm_and_target_poses, write_manifest, write_pictures

ARMS, _ = arm_and_target_poses()
IDS = [f"{k}" for k in range(1, 11)]


def record(folder: Path, ids: Sequence[str] = IDS, pose_ids: Sequence[str] = IDS) -> None:
    write_pictures(folder / "images", ids)
    write_poses(
        folder / "poses.csv", dict(zip(pose_ids, ARMS, strict=False)), "matrix4x4_row_major"
    )


def complaint(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_recording(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def assert_paired(recording: Recording) -> None:
    """Picture k with pose k, in natural order."""
    assert [view.id for view in recording.views] == IDS
    for view, T in zip(recording.views, ARMS, strict=True):
        assert view.picture is not None
        assert view.picture.stem == view.id
        assert np.abs(view.T_base_flange.homogeneous - T.homogeneous).max() < 1e-12


@pytest.mark.parametrize("pairing", ["order", "name"])
def test_a_recording_with_a_table(tmp_path: Path, pairing: str) -> None:
    record(tmp_path)
    recording = read_recording(write_manifest(tmp_path, pairing=pairing))
    assert_paired(recording)
    assert recording.mount == "eye_in_hand"
    assert recording.warnings == ()
    (camera,) = recording.cameras
    assert (camera.size, camera.intrinsics, camera.refine) == ((64, 48), None, True)
    (target,) = recording.targets
    assert (target.camera, target.mount) == (["camera"], "eye_in_hand")


def test_a_shuffled_table_is_paired_by_name(tmp_path: Path) -> None:
    record(tmp_path)
    lines = (tmp_path / "poses.csv").read_text().splitlines()
    (tmp_path / "poses.csv").write_text("\n".join([lines[0], *reversed(lines[1:])]))
    recording = read_recording(write_manifest(tmp_path, pairing="name"))
    assert sorted(v.id for v in recording.views) == sorted(IDS)
    by_id = {view.id: view for view in recording.views}
    assert by_id["10"].T_base_flange.isApprox(ARMS[9], 1e-12)
    assert by_id["1"].picture == tmp_path / "images" / "1.png"


def test_by_order_a_shuffled_table_is_warned_about(tmp_path: Path) -> None:
    record(tmp_path)
    lines = (tmp_path / "poses.csv").read_text().splitlines()
    (tmp_path / "poses.csv").write_text("\n".join([lines[0], *reversed(lines[1:])]))
    (warning,) = read_recording(write_manifest(tmp_path)).warnings
    assert warning.startswith("picture '1' is paired by order with pose '10' although there is")


def test_the_star_of_both_globs_is_the_name(tmp_path: Path) -> None:
    write_pictures(tmp_path / "images", [f"img_{id}" for id in IDS])
    (tmp_path / "poses").mkdir()
    write_poses(tmp_path / "poses" / "pose_*_base.yaml", dict(zip(IDS, ARMS, strict=True)),
                "visp_vector")  # fmt: skip
    recording = read_recording(
        write_manifest(tmp_path, images="images/img_*.png", poses="poses/pose_*_base.yaml",
                       pose_format="visp_vector", pairing="name")
    )  # fmt: skip
    assert [view.id for view in recording.views] == IDS
    assert recording.views[9].T_base_flange.isApprox(ARMS[9], 1e-12)


def test_a_column_may_name_the_files(tmp_path: Path) -> None:
    record(tmp_path, pose_ids=[f"{id}.png" for id in IDS])
    assert_paired(read_recording(write_manifest(tmp_path, pairing="name")))


@pytest.mark.parametrize("meaning", ["T_base_flange", "T_flange_base"])
@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("mm", 1e3)])
def test_conventions(tmp_path: Path, meaning: str, unit: str, scale: float) -> None:
    record(tmp_path)
    Ts = [T if meaning == "T_base_flange" else T.inverse() for T in ARMS]
    Ts = [SE3(T.rotation, T.translation * scale) for T in Ts]
    write_poses(tmp_path / "poses.csv", dict(zip(IDS, Ts, strict=True)), "matrix4x4_row_major")
    path = write_manifest(tmp_path, pose_meaning=meaning, length_unit=unit)
    assert_paired(read_recording(path))


# -- What does not belong together --------------------------------------------------------


def test_as_many_pictures_as_poses_by_order(tmp_path: Path) -> None:
    record(tmp_path, ids=IDS[:-1])
    message = complaint(write_manifest(tmp_path))
    assert "9 pictures of 'camera' and 10 poses; 'views.pairing' = 'order' needs as many" in message


def test_a_picture_without_a_pose_is_named(tmp_path: Path) -> None:
    record(tmp_path, pose_ids=IDS[:-2])
    message = complaint(write_manifest(tmp_path, pairing="name"))
    assert (
        f"no pose for {tmp_path / 'images' / '9.png'}, {tmp_path / 'images' / '10.png'}" in message
    )


def test_a_pose_without_a_picture_is_a_warning(tmp_path: Path) -> None:
    record(tmp_path, ids=IDS[:-1])
    recording = read_recording(write_manifest(tmp_path, pairing="name"))
    assert recording.warnings == ("no picture for pose 10",)
    assert len(recording.views) == 9


def test_a_pose_that_stands_twice_is_named(tmp_path: Path) -> None:
    record(tmp_path)
    text = (tmp_path / "poses.csv").read_text()
    (tmp_path / "poses.csv").write_text(text + text.splitlines()[3] + "\n")
    message = complaint(write_manifest(tmp_path, pairing="name"))
    expected = f"line 12: pose '3' stands twice, first in {tmp_path / 'poses.csv'}, line 4"
    assert expected in message


def test_pictures_of_the_same_name_are_named(tmp_path: Path) -> None:
    record(tmp_path)
    write_pictures(tmp_path / "images" / "b", ["1"])
    write_pictures(tmp_path / "images" / "a", ["1"])
    message = complaint(write_manifest(tmp_path, images="images/*/*.png"))
    assert "images/a/1.png and " in message
    assert "are both picture '1'" in message


@pytest.mark.parametrize(
    ("unit", "scale", "expected"),
    [("m", 1e3, "'views.length_unit' = 'm': the pose in "), ("mm", 1.0, "'mm': no pose would be")],
)
def test_the_wrong_unit_is_noticed(tmp_path: Path, unit: str, scale: float, expected: str) -> None:
    record(tmp_path)
    Ts = {i: SE3(T.rotation, T.translation * scale) for i, T in zip(IDS, ARMS, strict=True)}
    write_poses(tmp_path / "poses.csv", Ts, "matrix4x4_row_major")
    path = write_manifest(tmp_path, length_unit=unit)
    message = complaint(path)
    assert message.startswith(f"{path}: ")
    assert expected in message
    assert message.endswith(f"is the unit '{'mm' if unit == 'm' else 'm'}'?")
    assert len(read_recording(path, check_lengths=False).views) == 10


# -- Pictures and cameras -----------------------------------------------------------------


def test_a_file_that_is_no_picture_is_named_and_not_fatal(tmp_path: Path) -> None:
    record(tmp_path)
    (tmp_path / "images" / "3.png").write_bytes(b"not a picture")
    write_pictures(tmp_path / "images", ["5"], size=(32, 24))
    views = read_recording(write_manifest(tmp_path)).views
    problems = {view.id: view.pictures[0].problem for view in views if view.pictures[0].problem}
    assert sorted(problems) == ["3", "5"]
    assert problems["3"].endswith("3.png is no picture that can be read")
    assert problems["5"].endswith("5.png has 32x24 px, the others 64x48")


def test_no_picture_at_all_is_fatal(tmp_path: Path) -> None:
    record(tmp_path)
    for file in (tmp_path / "images").iterdir():
        file.write_bytes(b"")
    assert "none of the 10 files for camera 'camera' is a picture" in complaint(
        write_manifest(tmp_path)
    )


def test_the_camera_to_start_from(tmp_path: Path) -> None:
    record(tmp_path)
    (tmp_path / "camera.yaml").write_text("intrinsics:\n fx: 50\n fy: 51\n cx: 30\n cy: 20\n")
    path = write_manifest(tmp_path, MANIFEST + '[camera]\nintrinsics = "camera.yaml"\n')
    (camera,) = read_recording(path).cameras
    assert camera.intrinsics is not None
    assert (camera.intrinsics.width, camera.intrinsics.height) == (64, 48)
    assert camera.intrinsics.K[0, 0] == 50
    assert not camera.refine


def test_two_cameras_share_their_poses(tmp_path: Path) -> None:
    record(tmp_path)
    write_pictures(tmp_path / "tripod", IDS[:4], size=(32, 24))
    text = MANIFEST.replace('images = "images/*.png"\n', "").replace("order", "name")
    second = text[text.index("[[target]]") : text.index("[views]")]
    text = text.replace("rows = 6", 'rows = 6\ncamera = "tripod"\nmount = "eye_to_hand"')
    text += second.replace("rows = 6", 'rows = 6\ncamera = "hand"')
    text += '[[camera]]\nname = "hand"\nimages = "images/*.png"\n'
    text += '[[camera]]\nname = "tripod"\nimages = "tripod/*.png"\n'
    recording = read_recording(write_manifest(tmp_path, text))
    assert [[p.camera for p in view.pictures] for view in recording.views[3:5]] == [
        ["hand", "tripod"], ["hand"]
    ]  # fmt: skip
    assert [camera.size for camera in recording.cameras] == [(64, 48), (32, 24)]
    assert [camera.mount for camera in recording.cameras] == ["eye_in_hand", "eye_to_hand"]
    assert [target.camera for target in recording.targets] == [["tripod"], ["hand"]]


def test_pictures_may_be_colour_or_sixteen_bit(tmp_path: Path) -> None:
    record(tmp_path)
    Pillow.fromarray(np.zeros((48, 64, 3), np.uint8)).save(tmp_path / "images" / "1.png")
    Pillow.fromarray(np.zeros((48, 64), np.uint16)).save(tmp_path / "images" / "2.png")
    views = read_recording(write_manifest(tmp_path)).views
    assert not any(view.pictures[0].problem for view in views)


def test_a_target_that_cannot_be_is_named(tmp_path: Path) -> None:
    record(tmp_path)
    path = write_manifest(tmp_path, MANIFEST.replace("columns = 9", "columns = 6"))
    assert complaint(path).startswith(f"{path}: 'target.0': chessboard: 6x6 inner corners look")


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("mm", 1e3)])
def test_pose_pairs_have_one_unit_and_the_arms_direction(
    tmp_path: Path, unit: str, scale: float
) -> None:
    _, seen = arm_and_target_poses()
    pairs = [
        [SE3(T.rotation, T.translation * scale).homogeneous.tolist() for T in (A.inverse(), B)]
        for A, B in zip(ARMS, seen, strict=True)
    ]
    (tmp_path / "s.json").write_text(json.dumps(pairs))
    text = 'mount = "eye_in_hand"\n[views]\npairs = "s.json"\npose_meaning = "T_flange_base"\n'
    text += f'pair_format = "json_effector_and_object"\nlength_unit = "{unit}"'
    recording = read_recording(write_manifest(tmp_path, text))
    assert (recording.targets, recording.cameras) == ((), ())
    for view, A, B in zip(recording.views, ARMS, seen, strict=True):
        assert view.picture is None
        assert view.T_camera_target is not None
        assert view.T_base_flange.isApprox(A, 1e-12)
        assert view.T_camera_target.isApprox(B, 1e-12)
    wrong = "mm" if unit == "m" else "m"
    message = complaint(write_manifest(tmp_path, text, length_unit=wrong))
    assert f"'views.length_unit' = '{wrong}'" in message
