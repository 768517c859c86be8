"""`aoicell calibrate`: results for people and machines, files for robots, refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.recordings import T_FLANGE_CAMERA, blank, record
from helpers.running import run_cli

from aoicell.datasets.yaml_tree import read_tree


@pytest.fixture(scope="module")
def manifest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("recordings") / "arm")


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recordings") / "blank"
    return record(folder, change=blank(range(10)))


def test_json_and_overlays(manifest: Path, tmp_path: Path) -> None:
    run = run_cli("calibrate", manifest, "--json", "--report", tmp_path / "figures")
    assert run.code == 0, run.stderr
    assert run.summary["verdict"] == "ok"
    keys = (
        "T_flange_camera T_base_target camera rms_px holdout_px scatter_mm std_mm std_deg"
        " target_scale target_scale_std views warnings verdict reasons"
    )
    assert set(keys.split()) <= set(run.summary)
    place = np.array(run.summary["T_flange_camera"]["matrix"])[:3, 3]
    np.testing.assert_allclose(place, T_FLANGE_CAMERA.translation, atol=6e-4)
    assert len(run.summary["std_mm"]) == len(run.summary["std_deg"]) == 3
    assert set(run.summary["views"][0]) >= {"id", "used", "reason", "rms_px"}
    assert "figures are in" in run.stderr
    assert len(list((tmp_path / "figures").glob("*.png"))) == 11


def test_the_table_and_a_file_for_robots(manifest: Path, tmp_path: Path) -> None:
    file = tmp_path / "arm.calib"
    run = run_cli(
        "calibrate", manifest, "--out", file, "--format", "easy_handeye2", "--base-frame", "world"
    )
    assert run.code == 0, run.stderr
    for text in ("T_flange_camera", "T_base_target", "Verdict: ok", "10 of 10 views used"):
        assert text in run.stdout
    tree = read_tree(file)
    assert tree["parameters"]["robot_base_frame"] == "world"
    assert tree["transform"]["translation"]["z"] == pytest.approx(0.071, abs=6e-4)


def test_a_refusal_has_the_reason_and_no_file_for_robots(refused: Path, tmp_path: Path) -> None:
    file, robot = tmp_path / "result.json", tmp_path / "robot.launch"
    run = run_cli("calibrate", refused, "--json", "--out", file)
    assert run.code == 3
    assert "none of the 10 views shows a target" in run.stderr
    assert "Traceback" not in run.stderr
    assert json.loads(file.read_text()) == run.summary
    assert (run.summary["verdict"], run.summary["T_flange_camera"]) == ("refused", None)
    assert run_cli("calibrate", refused, "--out", robot, "--format", "moveit").code == 3
    assert not robot.exists()


def test_bad_input_is_one_sentence(manifest: Path, tmp_path: Path) -> None:
    missing = run_cli("calibrate", tmp_path / "none.toml")
    assert missing.code == 2
    assert "no such manifest" in missing.stderr
    bad = tmp_path / "manifest.toml"
    bad.write_text(manifest.read_text().replace('pose_meaning = "T_base_flange"\n', ""))
    run = run_cli("calibrate", bad, "--json")
    assert (run.code, run.stdout) == (2, "")
    assert "'T_base_flange', 'T_flange_base'" in run.stderr
    (line,) = run.stderr.strip().splitlines()
    assert line.startswith("aoicell: ")


def test_suggest_changes_nothing(manifest: Path) -> None:
    before = sorted(manifest.parent.rglob("*")), manifest.read_text()
    run = run_cli("calibrate", manifest, "--suggest", "--json")
    assert run.code == 0, run.stderr
    readings = run.summary["readings"]
    assert readings[0]["changes"] == []
    assert readings[0]["scatter_mm"] < 1
    assert readings[-1]["reason"]
    assert (sorted(manifest.parent.rglob("*")), manifest.read_text()) == before
    table = run_cli("calibrate", manifest, "--suggest")
    assert "as the manifest stands" in table.stdout
