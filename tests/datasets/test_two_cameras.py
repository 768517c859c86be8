"""Two cameras and two targets in one solve, from a manifest to a result: against the truth."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.recordings import T_BASE_TARGET, T_FLANGE_CAMERA

from aoicell.calibration.calibrate import CalibrationConfig
from aoicell.datasets.describe import describe
from aoicell.datasets.other_readings import suggest_readings
from aoicell.datasets.recording import read_recording
from aoicell.datasets.sightings import Found
from aoicell.datasets.solve import Solved, detect, solve_recording
from aoicell.transforms import distance_deg, distance_mm, from_matrix

from .two_cameras import (
    ARM_TARGET,
    BOTH,
    MANIFEST,
    T_BASE_TRIPOD,
    T_FLANGE_ARMTARGET,
    TRIPOD,
    projected,
    write,
)

QUICK = CalibrationConfig(lenses=("k1k2p1p2",), robots=("per_view",))
ALONE = MANIFEST.replace(ARM_TARGET, "")  # the tripod sees the table's board only
LENS_KEPT = ALONE[: ALONE.rindex("refine = true")] + "refine = false\n"


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Solved:
    path = write(tmp_path_factory.mktemp("two") / "cameras", MANIFEST)
    return solve_recording(read_recording(path))


@pytest.fixture
def projection(monkeypatch: pytest.MonkeyPatch) -> None:
    """Points are projected instead of found in pictures, which takes no time."""
    monkeypatch.setattr("aoicell.datasets.solve.find_targets", projected)


def solve(folder: Path, manifest: str) -> dict[str, Any]:
    path = write(folder, manifest, rendered=False)
    return describe(solve_recording(read_recording(path), QUICK))


def test_every_camera_and_target_is_near_the_truth(solved: Solved) -> None:
    values = describe(solved)
    assert values["verdict"] == "ok", values["reasons"]
    hand, tripod = values["cameras"]
    table, arm = values["targets"]
    for described, key, T, mm in (
        (hand, "T_flange_camera", T_FLANGE_CAMERA, 0.6),
        (tripod, "T_base_camera", T_BASE_TRIPOD, 1.5),
        (table, "T_base_target", T_BASE_TARGET, 0.3),
        (arm, "T_flange_target", T_FLANGE_ARMTARGET, 1.0),
    ):
        found = from_matrix(described[key]["matrix"])
        assert distance_mm(found, T) < mm
        assert distance_deg(found, T) < 0.15
    for described, T in ((hand, T_FLANGE_CAMERA), (tripod, T_BASE_TRIPOD)):
        key = "T_flange_camera" if described is hand else "T_base_camera"
        gap_mm = distance_mm(from_matrix(described[key]["matrix"]), T)
        assert gap_mm < 3 * np.linalg.norm(described["std_mm"])
    assert tripod["K"][0][0] == pytest.approx(TRIPOD.K[0, 0], rel=5e-3)
    assert values["holdout_px"] < 0.2


def test_the_first_camera_heads_the_result(solved: Solved) -> None:
    values = describe(solved)
    assert values["mount"] == "eye_in_hand"
    assert values["T_flange_camera"] == values["cameras"][0]["T_flange_camera"]
    assert values["T_base_target"] == values["targets"][0]["T_base_target"]
    assert [t["name"] for t in values["targets"]] == ["table", "arm"]


def test_each_cameras_sightings_are_its_own(solved: Solved) -> None:
    views = solved.detected.problem.views
    seen = [(s.eye, s.fixture) for view in views for s in view.sights]
    assert seen.count(("hand", "table")) == 10
    assert seen.count(("tripod", "table")) == seen.count(("tripod", "arm")) >= BOTH
    mounts = {eye.name: eye.mount for eye in solved.detected.problem.eyes}
    assert mounts == {"hand": "flange", "tripod": "base"}


@pytest.mark.usefixtures("projection")
def test_a_shared_target_alone_places_a_calibrated_tripod(tmp_path: Path) -> None:
    values = solve(tmp_path / "tie", LENS_KEPT)
    assert values["verdict"] == "ok", values["reasons"]
    T = from_matrix(values["cameras"][1]["T_base_camera"]["matrix"])
    assert distance_mm(T, T_BASE_TRIPOD) < 4  # 1.3 m away, and ten times the same picture
    assert distance_deg(T, T_BASE_TRIPOD) < 0.2


@pytest.mark.usefixtures("projection")
def test_the_lens_of_a_camera_before_which_nothing_moves_is_asked_for(tmp_path: Path) -> None:
    values = solve(tmp_path / "lens", ALONE)
    assert values["verdict"] == "refused"
    assert "all that 'tripod' sees stands still before it" in values["reasons"][0]
    assert "refine = false" in values["reasons"][0]


def test_a_camera_and_a_target_that_are_never_found_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def without_the_tripod(*args: Any) -> dict[str, Found]:
        return {
            id: Found({s: f.sightings[s] for s in f.sightings if s[0] == "hand"}, {})
            for id, f in projected(*args).items()
        }

    monkeypatch.setattr("aoicell.datasets.solve.find_targets", without_the_tripod)
    values = solve(tmp_path / "never", MANIFEST)
    assert values["verdict"] == "refused"
    assert any("'tripod' sees no target in any view" in r for r in values["reasons"])
    assert any("no view shows 'arm'" in r for r in values["reasons"])
    assert any("'table' was found in 0 of 10 views of 'tripod'" in w for w in values["warnings"])


@pytest.mark.usefixtures("projection")
def test_a_tripod_said_to_ride_on_the_flange_is_refused(tmp_path: Path) -> None:
    wrong = MANIFEST.replace(
        'name = "tripod"\nmount = "eye_to_hand"', 'name = "tripod"\nmount = "eye_in_hand"'
    )
    assert (solve(tmp_path / "wrong", wrong))["verdict"] == "refused"


@pytest.mark.usefixtures("projection")
def test_suggest_looks_at_the_pair_that_moves(tmp_path: Path) -> None:
    tripod_first = MANIFEST.replace('["hand", "tripod"]', '["tripod", "hand"]')
    path = write(
        tmp_path / "inverse", tripod_first.replace("T_base_flange", "T_flange_base"), False
    )
    readings = suggest_readings(path)
    assert readings[0].changes == ('[views] pose_meaning = "T_base_flange"',)
    assert readings[0].scatter_mm < 1
    assert detect(read_recording(path)).problem.views[0].id == "00"
