"""From a recording to a judged calibration: the truth of rendered pictures, and what is wrong."""

from pathlib import Path

import numpy as np
import pytest
from helpers.printed import BENT
from helpers.recordings import (
    EVEN,
    T_BASE_TARGET,
    T_FLANGE_CAMERA,
    blank,
    flange_poses,
    looks,
    record,
)

from aoicell.camera import Camera
from aoicell.datasets.describe import describe
from aoicell.datasets.other_readings import suggest_readings
from aoicell.datasets.recording import read_recording
from aoicell.datasets.solve import Solved, detect, solve_recording
from aoicell.errors import InputError
from aoicell.transforms import distance_deg, distance_mm, from_matrix

# The views of one board in 640x480 px: what its points' noise of a few hundredths of a pixel
# leaves of the camera's place.
NEAR_MM, NEAR_DEG = 0.6, 0.1


@pytest.fixture(scope="module")
def manifest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("recordings") / "odd")


@pytest.fixture(scope="module")
def solved(manifest: Path) -> Solved:
    return solve_recording(read_recording(manifest))


def edited(manifest: Path, tmp_path: Path, old: str, new: str) -> Path:
    """The recording under a manifest in which a text is replaced."""
    for name in ("images", "poses.csv", "camera.yaml"):
        (tmp_path / name).symlink_to(manifest.parent / name)
    text = manifest.read_text()
    assert old in text
    path = tmp_path / "manifest.toml"
    path.write_text(text.replace(old, new))
    return path


def check_near_truth(solved: Solved, camera: str, target: str) -> None:
    values = describe(solved)
    T_camera, T_target = (from_matrix(values[key]["matrix"]) for key in (camera, target))
    assert distance_mm(T_camera, T_FLANGE_CAMERA) < NEAR_MM
    assert distance_deg(T_camera, T_FLANGE_CAMERA) < NEAR_DEG
    assert distance_mm(T_target, T_BASE_TARGET) < NEAR_MM
    assert values["verdict"] == "ok", values["reasons"]
    assert values["holdout_px"] < 0.2
    assert values["holdout_mm"] < 0.1
    assert values["scatter_mm"] < 0.5


def test_eye_in_hand_is_near_the_truth(solved: Solved) -> None:
    check_near_truth(solved, "T_flange_camera", "T_base_target")
    values = describe(solved)
    assert values["camera"]["K"][0][0] == pytest.approx(BENT.K[0, 0], rel=3e-3)
    gap_mm = np.linalg.norm(
        np.array(values["T_flange_camera"]["matrix"])[:3, 3] - T_FLANGE_CAMERA.translation
    ) * 1e3  # fmt: skip
    assert gap_mm < 4 * np.linalg.norm(values["std_mm"])
    assert abs(values["target_scale"] - 1) < 4 * values["target_scale_std"]
    assert [view["used"] for view in values["views"]] == [True] * 10


def test_eye_to_hand_with_an_even_board_and_no_intrinsics(tmp_path: Path) -> None:
    path = record(tmp_path / "hand", EVEN, "eye_to_hand", start=None)
    solved = solve_recording(read_recording(path))
    values = describe(solved)
    T_camera = from_matrix(values["T_base_camera"]["matrix"])
    assert distance_mm(T_camera, T_FLANGE_CAMERA) < NEAR_MM
    assert values["verdict"] == "ok", values["reasons"]
    assert values["camera"]["K"][0][0] == pytest.approx(BENT.K[0, 0], rel=3e-3)
    assert any("no intrinsics are given" in warning for warning in values["warnings"])
    # which end of an even board is up stays open, its middle does not
    T_target = np.array(values["T_flange_target"]["matrix"])
    np.testing.assert_allclose(T_target[:3, 3], T_BASE_TARGET.translation, atol=NEAR_MM * 1e-3)


def test_blank_and_broken_pictures_are_named_and_left_out(tmp_path: Path) -> None:
    path = record(tmp_path / "some", change=blank([3]))
    (path.parent / "images" / "05.png").write_bytes(b"no picture")
    values = describe(solve_recording(read_recording(path)))
    views = {view["id"]: view for view in values["views"]}
    assert "blank" in views["03"]["reason"]
    assert "no picture" in views["05"]["reason"]
    assert [id for id, view in views.items() if not view["used"]] == ["03", "05"]
    T_camera = from_matrix(values["T_flange_camera"]["matrix"])
    assert distance_mm(T_camera, T_FLANGE_CAMERA) < NEAR_MM


def test_all_blank_is_refused_with_the_reason(tmp_path: Path) -> None:
    path = record(tmp_path / "blank", change=blank(range(10)))
    values = describe(solve_recording(read_recording(path)))
    assert values["verdict"] == "refused"
    assert "none of the 10 views shows a target" in values["reasons"][0]
    assert "blank" in values["reasons"][0]
    assert values["T_flange_camera"] is None
    assert values["targets"] == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("columns = 7", "columns = 5"),
        pytest.param("columns = 7", "columns = 8", marks=pytest.mark.slow),
        pytest.param("rows = 6", "rows = 5", marks=pytest.mark.slow),
        ("T_base_flange", "T_flange_base"),
        ("eye_in_hand", "eye_to_hand"),
        ("square_mm = 16.0", "square_mm = 25.4"),
    ],
)
def test_a_wrong_manifest_is_refused(manifest: Path, tmp_path: Path, old: str, new: str) -> None:
    solved = solve_recording(read_recording(edited(manifest, tmp_path, old, new)))
    values = describe(solved)
    assert values["verdict"] == "refused"
    assert values["reasons"]
    assert values.get("T_flange_camera") is None
    assert values.get("T_base_camera") is None


def test_a_slightly_wrong_size_is_measured(manifest: Path, tmp_path: Path) -> None:
    path = edited(manifest, tmp_path, "square_mm = 16.0", "square_mm = 16.4")
    values = describe(solve_recording(read_recording(path)))
    assert values["verdict"] == "suspect"
    assert values["target_scale"] == pytest.approx(16 / 16.4, abs=4 * values["target_scale_std"])
    assert values["target_scale_std"] < 0.003
    assert "measure the print" in values["reasons"][0]


def test_millimetres_read_as_metres_are_bad_input(manifest: Path, tmp_path: Path) -> None:
    path = edited(manifest, tmp_path, 'length_unit = "m"', 'length_unit = "mm"')
    with pytest.raises(InputError, match="is the unit 'm'"):
        read_recording(path)


def test_shuffled_poses_are_never_ok(tmp_path: Path) -> None:
    """Two exchanged: found and named. All moved by one: refused."""
    path = record(tmp_path / "two", order=[0, 1, 2, 7, 4, 5, 6, 3, 8, 9])
    values = describe(solve_recording(read_recording(path)))
    unused = {view["id"]: view["reason"] for view in values["views"] if not view["used"]}
    assert values["verdict"] == "suspect"
    assert set(unused) == {"03", "07"}
    assert "arm pose of view '07'" in unused["03"]
    path = record(tmp_path / "all", order=[*range(1, 10), 0])
    assert describe(solve_recording(read_recording(path)))["verdict"] == "refused"


def test_a_start_far_off_does_no_harm(tmp_path: Path) -> None:
    path = record(tmp_path / "far", start=Camera.pinhole(800.0, 640, 480))
    values = describe(solve_recording(read_recording(path)))
    T_camera = from_matrix(values["T_flange_camera"]["matrix"])
    assert distance_mm(T_camera, T_FLANGE_CAMERA) < NEAR_MM
    assert any("intrinsics to start from" in warning for warning in values["warnings"])


def test_sightings_are_those_of_the_right_view(solved: Solved) -> None:
    """Each view's points lie where the truth projects them."""
    problem = detect(solved.recording).problem
    points = problem.fixtures[0].points
    for view, T, arm in zip(problem.views, looks(), flange_poses(), strict=True):
        (sight,) = view.sights
        expected = BENT.project(points[sight.ids], T.inverse())  # type: ignore[union-attr]
        assert np.abs(sight.uv_px - expected).max() < 0.3  # type: ignore[union-attr]
        assert view.T_base_flange.isApprox(arm, 1e-9)


@pytest.mark.parametrize("mount", ["eye_in_hand", "eye_to_hand"])
def test_suggest_ranks_the_true_reading_first(manifest: Path, tmp_path: Path, mount: str) -> None:
    wrong = edited(manifest, tmp_path, "T_base_flange", "T_flange_base")
    wrong.write_text(wrong.read_text().replace("eye_in_hand", mount))
    before = wrong.read_text()
    readings = suggest_readings(wrong)
    fitting = [r.changes for r in readings if r.scatter_mm < 1]
    as_it_stands = next(r for r in readings if not r.changes)
    if mount == "eye_in_hand":
        assert ('[views] pose_meaning = "T_base_flange"',) in fitting
        assert as_it_stands.scatter_mm > 20
    else:  # both choices turned about: no data can tell
        assert as_it_stands.scatter_mm < 1
    assert wrong.read_text() == before


def test_suggest_copes_with_even_boards(tmp_path: Path) -> None:
    path = record(tmp_path / "even", EVEN)
    best = suggest_readings(path)[0]
    assert best.changes == ()
    assert best.scatter_mm < 1
