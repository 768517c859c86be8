"""Recordings of the cell: complete, readable by our own reader, the truth apart."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from aoicell.benchmark.recording import record_scenario
from aoicell.camera import Camera
from aoicell.datasets.recording import read_recording
from aoicell.datasets.solve import solve_recording
from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.observation import Observation, RobotState
from aoicell.scenario import Scenario
from aoicell.targets.detector import IN_PICTURES
from aoicell.transforms import SE3

SCENARIO = Scenario(name="r", profile="ideal", trials_per_world=1, seed=2)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recorded") / "r"
    seen: list[str] = []
    count = record_scenario(SCENARIO, folder, seen.append)
    assert seen == ["world0"]
    assert count == len(list(folder.rglob("*.png")))
    return folder


def test_the_manifests_read_back(recorded: Path, nominal: Nominal) -> None:
    hand = read_recording(recorded / "world0" / "hand_eye" / "manifest.toml")
    assert hand.mount == "eye_in_hand"
    assert hand.warnings == ()
    assert {"table_2_A", "table_2_F", "view_01"} <= {view.id for view in hand.views}
    tripod = read_recording(recorded / "world0" / "tripod" / "manifest.toml")
    assert tripod.mount == "eye_to_hand"
    squares = {t.name: t.square_mm for r in (hand, tripod) for t in r.targets}  # type: ignore[union-attr]
    assert squares == pytest.approx(
        {"tabletarget": 1e3 * nominal.tabletarget.square,
         "armtarget": 1e3 * nominal.armtarget.square}
    )  # fmt: skip
    assert [t.mount for t in tripod.targets] == ["eye_to_hand", "eye_in_hand"]  # flange, table


def test_the_joint_angles_belong_to_the_poses(recorded: Path) -> None:
    for folder in ("hand_eye", "tripod"):
        recording = read_recording(recorded / "world0" / folder / "manifest.toml")
        assert recording.arm is not None
        for view in recording.views:
            assert view.q is not None
            assert recording.arm.fk(view.q).isApprox(view.T_base_flange, 1e-9)


def test_the_tripods_two_boards_calibrate_to_the_truth(recorded: Path) -> None:
    truth = json.loads((recorded / "truth.json").read_text())["worlds"][0]
    solved = solve_recording(read_recording(recorded / "world0" / "tripod" / "manifest.toml"))
    assert solved.report.verdict == "ok", solved.report.reasons
    solution = solved.report.solution
    assert solution is not None
    places = {"armtarget": "T_flange_armtarget", "tabletarget": "T_base_tabletarget"}
    for name, key in places.items():
        gap = solution.estimate.T_mount_fixture[name].translation - np.array(truth[key])[:3, 3]
        assert np.linalg.norm(gap) < 5e-4


def test_poses_pictures_and_truth_belong_together(recorded: Path, nominal: Nominal) -> None:
    """Board corners through truth and recorded pose appear where they are detected."""
    truth = json.loads((recorded / "truth.json").read_text())["worlds"][0]
    hand = read_recording(recorded / "world0" / "hand_eye" / "manifest.toml")
    view = next(view for view in hand.views if view.id == "table_2_B")
    assert view.picture is not None
    image = cv2.imread(str(view.picture), cv2.IMREAD_GRAYSCALE)
    T_flange_camera = SE3(np.array(truth["T_flange_camera"]))
    T_base_board = SE3(np.array(truth["T_base_tabletarget"]))
    lens = truth["cameras"]["hand"]
    camera = Camera(
        np.array(lens["K"]), lens["width"], lens["height"],
        np.array(lens["distortion_k1_k2_p1_p2_k3"]),
    )  # fmt: skip
    T_camera_board = (view.T_base_flange * T_flange_camera).actInv(T_base_board)
    expected = camera.project(nominal.tabletarget.corners, T_camera_board)
    state = RobotState(nominal.q_home, view.T_base_flange)
    found = IN_PICTURES.chessboard(Observation(image, state), nominal.tabletarget, "B")
    gaps = [np.linalg.norm(uv - expected, axis=1).max() for uv in (found, found[::-1])]
    assert min(gaps) < 0.1


def test_the_truth_stands_nowhere_else(recorded: Path) -> None:
    for path in recorded.rglob("*"):
        if path.suffix in (".toml", ".csv", ".yaml", ".json") and path.name != "truth.json":
            assert "T_base_board" not in path.read_text()
    board = recorded / "world0" / "board"
    names = {path.stem for path in (board / "images").iterdir()}
    assert {"taught_check", "taught_V1", "trial_0_check", "trial_0_overview"} <= names
    rows = (board / "poses.csv").read_text().splitlines()
    assert len(rows) == len(names) + 1


def test_nothing_is_overwritten(recorded: Path) -> None:
    with pytest.raises(InputError, match="not empty; name a new folder"):
        record_scenario(SCENARIO, recorded)


def test_without_pictures_there_is_nothing_to_record(tmp_path: Path) -> None:
    blind = SCENARIO.model_copy(update={"pictures": False})
    with pytest.raises(InputError, match="pictures = false"):
        record_scenario(blind, tmp_path)
