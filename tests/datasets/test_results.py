"""Results as files: the project's JSON and those of other tools."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from aoicell.camera import Camera
from aoicell.datasets.results import (
    FrameNames,
    HandEyeResult,
    TargetResult,
    ViewResult,
    to_easy_handeye2,
    to_json,
    to_moveit_launch,
)
from aoicell.datasets.yaml_tree import read_tree
from aoicell.errors import InputError
from aoicell.transforms import SE3

from .robots import X, Z

FRAMES = FrameNames("base_link", "tool0", "camera_optical_frame")
RESULT = HandEyeResult(
    mount="eye_in_hand",
    T_mount_camera=X,
    targets=(TargetResult("board", Z, 0.998, 0.001),),
    verdict="suspect",
    reasons=("few views",),
    camera=Camera.pinhole(1400.0, 1600, 1200),
    rms_px=0.2,
    std_mm=np.array([0.1, 0.2, 0.3]),
    views=(ViewResult("1", True, rms_px=0.1), ViewResult("2", False, "blank")),
)


def test_the_projects_json_eye_in_hand() -> None:
    values = json.loads(to_json(RESULT))
    np.testing.assert_array_equal(values["T_flange_camera"]["matrix"], X.homogeneous)
    np.testing.assert_array_equal(values["T_base_target"]["matrix"], Z.homogeneous)
    assert values["camera"]["K"] == [[1400, 0, 799.5], [0, 1400, 599.5], [0, 0, 1]]
    assert values["camera"]["size_px"] == [1600, 1200]
    assert (values["target_scale"], values["target_scale_std"]) == (0.998, 0.001)
    assert values["std_mm"] == [0.1, 0.2, 0.3]
    assert values["std_deg"] is None
    assert values["holdout_px"] is None
    assert values["views"][1] == {"id": "2", "used": False, "reason": "blank", "rms_px": None}
    assert (values["verdict"], values["reasons"]) == ("suspect", ["few views"])
    assert "targets" not in values


def test_eye_to_hand_has_other_frames_and_several_targets_a_list() -> None:
    two = (*RESULT.targets, TargetResult("second", X))
    values = json.loads(to_json(replace(RESULT, mount="eye_to_hand", targets=two)))
    assert "T_flange_camera" not in values
    np.testing.assert_array_equal(values["T_base_camera"]["matrix"], X.homogeneous)
    np.testing.assert_array_equal(values["T_flange_target"]["matrix"], Z.homogeneous)
    assert [target["name"] for target in values["targets"]] == ["board", "second"]
    np.testing.assert_array_equal(values["targets"][1]["T_flange_target"]["matrix"], X.homogeneous)


def test_a_number_that_is_not_finite_is_null() -> None:
    values = json.loads(to_json(replace(RESULT, rms_px=float("nan"), holdout_px=float("inf"))))
    assert (values["rms_px"], values["holdout_px"]) == (None, None)


@pytest.mark.parametrize(
    ("mount", "calibration_type"), [("eye_in_hand", "eye_in_hand"), ("eye_to_hand", "eye_on_base")]
)
def test_easy_handeye2(tmp_path: Path, mount: str, calibration_type: str) -> None:
    result = replace(RESULT, mount=mount)  # type: ignore[arg-type]
    (tmp_path / "cell.calib").write_text(to_easy_handeye2(result, FRAMES, "cell"))
    tree = read_tree(tmp_path / "cell.calib")
    assert tree["parameters"]["calibration_type"] == calibration_type
    assert tree["parameters"]["robot_effector_frame"] == "tool0"
    assert tree["parameters"]["tracking_base_frame"] == "camera_optical_frame"
    t, q = tree["transform"]["translation"], tree["transform"]["rotation"]
    R = Rotation.from_quat([q["x"], q["y"], q["z"], q["w"]]).as_matrix()
    assert SE3(R, np.array([t["x"], t["y"], t["z"]])).isApprox(X, 1e-12)


@pytest.mark.parametrize(
    ("mount", "parent"), [("eye_in_hand", "tool0"), ("eye_to_hand", "base_link")]
)
def test_moveit(mount: str, parent: str) -> None:
    result = replace(RESULT, mount=mount)  # type: ignore[arg-type]
    node = ElementTree.fromstring(to_moveit_launch(result, FRAMES)).find("node")
    assert node is not None
    assert node.get("type") == "static_transform_publisher"
    *figures, frame, child = str(node.get("args")).split()
    assert (frame, child) == (parent, "camera_optical_frame")
    numbers = [float(figure) for figure in figures]
    R = Rotation.from_quat(numbers[3:]).as_matrix()  # x y z w
    assert SE3(R, np.array(numbers[:3])).isApprox(X, 1e-12)


def test_a_refused_calibration_reaches_no_robot() -> None:
    refused = replace(RESULT, verdict="refused")
    assert json.loads(to_json(refused))["verdict"] == "refused"
    with pytest.raises(InputError, match=r"refused \(few views\)"):
        to_moveit_launch(refused, FRAMES)
    with pytest.raises(InputError, match="refused"):
        to_easy_handeye2(refused, FRAMES, "cell")
