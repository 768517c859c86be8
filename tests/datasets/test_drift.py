"""A drift check from files: written, read again, compared, in words and exit codes."""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from helpers import recordings
from helpers.recordings import blank, record
from helpers.running import run_cli

from aoicell.datasets.drift import check_recording, describe_check, raise_unless_ok
from aoicell.datasets.recording import read_recording
from aoicell.datasets.result_files import KEY, read_reference
from aoicell.datasets.solve import solve_recording
from aoicell.errors import AoicellError, InputError, Refused
from aoicell.transforms import distance_mm


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("drift")


@pytest.fixture(scope="module")
def manifest(folder: Path) -> Path:
    return record(folder / "old")


@pytest.fixture(scope="module")
def result(folder: Path, manifest: Path) -> Path:
    file = folder / "result.json"
    run = run_cli("calibrate", manifest, "--out", file)
    assert run.code == 0, run.stderr
    return file


@pytest.fixture(scope="module")
def knocked(folder: Path) -> Path:
    """Five of the pictures, as if the camera had been turned by 0.6 deg since the calibration.

    A flange that stood turned the other way gives the same picture.
    """
    mount = recordings.T_FLANGE_CAMERA
    with pytest.MonkeyPatch.context() as patch:
        turned = mount * pin.exp6(np.array([0, 0, 0, np.radians(0.6), 0, 0]))
        patch.setattr(recordings, "T_FLANGE_CAMERA", turned)
        return record(folder / "knocked", change=blank(range(5)))


def test_what_is_written_is_read_again(manifest: Path, result: Path) -> None:
    reference = read_reference(result)
    report = solve_recording(read_recording(manifest)).report
    assert report.solution is not None
    assert report.uncertainty is not None
    estimate = report.solution.estimate
    (name,) = estimate.T_mount_eye
    assert distance_mm(reference.T_mount_eye, estimate.T_mount_eye[name]) < 1e-6
    assert reference.names == report.uncertainty.names
    np.testing.assert_allclose(reference.covariance, report.uncertainty.covariance, rtol=1e-9)
    assert reference.noise.sigma >= report.solution.noise.sigma * 0.999
    assert (reference.mount, reference.views) == ("flange", 10)
    assert reference.camera is not None
    np.testing.assert_allclose(reference.camera.K, estimate.cameras[name].K)


def test_an_untouched_camera_is_ok(manifest: Path, result: Path) -> None:
    run = run_cli("calibrate", manifest, "--check", result, "--json")
    assert run.code == 0, run.stderr
    assert run.summary["verdict"] == "ok"
    assert run.summary["changed"] is None
    assert {"camera on its mount", "focal length", "robot"} <= {
        test["group"] for test in run.summary["tests"]
    }


def test_a_knocked_camera_ends_with_1_and_its_size(knocked: Path, result: Path) -> None:
    run = run_cli("calibrate", knocked, "--check", result)
    assert run.code == 1
    assert "camera on its mount: moved" in run.stderr
    assert "used anyway" in run.stdout
    assert "Verdict: drifted" in run.stdout
    assert "warning: view '00'" in run.stderr
    described = describe_check(check_recording(knocked, result))
    assert json.loads(json.dumps(described, allow_nan=False)) == described
    change = described["changed"]
    assert change["group"] == "camera on its mount"
    assert change["deg"][0] == pytest.approx(0.6, abs=5 * change["std_deg"][0])
    assert max(change["std_deg"]) < 0.2


def test_one_picture_cannot_tell(folder: Path, result: Path) -> None:
    lone = record(folder / "lone", change=blank(range(9)))
    checked = check_recording(lone, result)
    with pytest.raises(Refused, match="cannot tell"):
        raise_unless_ok(checked, lone)
    described = describe_check(checked)
    assert (described["verdict"], described["hidden_std_mm"]) == ("cannot tell", None)
    assert len(described["warnings"]) == 9


def spoilt(result: Path, folder: Path, name: str, **values: object) -> Path:
    tree = json.loads(result.read_text())
    for key, value in values.items():
        (tree if key in tree else tree[KEY])[key] = value
    path = folder / f"{name}.json"
    path.write_text(json.dumps(tree))
    return path


def test_files_that_are_no_calibration_are_named(result: Path, folder: Path) -> None:
    text = folder / "text.json"
    text.write_text("not json")
    cases = [
        (folder / "none.json", "cannot be read"),
        (text, "no JSON"),
        (spoilt(result, folder, "refused", verdict="refused"), "was refused"),
        (spoilt(result, folder, "old", **{KEY: None}), f"'{KEY}' is missing"),
        (spoilt(result, folder, "short", covariance=[[1.0]]), "finite numbers are wanted"),
        (spoilt(result, folder, "noise", noise_px=-1), "not above 0"),
        (spoilt(result, folder, "lens", lens="fisheye"), "lens fisheye"),
        (spoilt(result, folder, "pose", T_flange_camera={"matrix": (2 * np.eye(4)).tolist()}),
         "no rigid transform"),
    ]  # fmt: skip
    for path, message in cases:
        with pytest.raises(InputError, match=message) as caught:
            read_reference(path)
        assert str(path) in str(caught.value)


def test_a_drifted_calibration_is_no_refusal(knocked: Path, result: Path) -> None:
    with pytest.raises(AoicellError) as caught:
        raise_unless_ok(check_recording(knocked, result), knocked)
    assert caught.value.exit_code == 1
