"""The whole way from a recording to a verdict: good ones are right, bad ones are never 'ok'."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from helpers.recorded import BAD, Conditions, draw_recording, spoil

from aoicell.calibration.calibrate import CalibrationConfig, calibrate
from aoicell.calibration.problem import CalibrationView, Eye, Fixture, PoseSight, Problem
from aoicell.camera import Camera
from aoicell.errors import InputError
from aoicell.transforms import distance_mm, from_rvec

REAL = Conditions(views=12, repeat_mm=0.02, repeat_deg=0.003)
PLAIN = CalibrationConfig(lenses=("k1k2",), robots=("per_view",))


def test_a_good_recording_is_ok_and_right() -> None:
    recording = draw_recording(0, replace(REAL, joint_deg=0.02, origin_mm=0.2, views=15))
    report = calibrate(recording.problem)
    assert (report.verdict, report.reasons) == ("ok", ())
    assert report.solution is not None
    assert report.uncertainty is not None
    assert report.solution.layout.model.robot == "joint_terms"
    X = report.solution.estimate.T_mount_eye["hand"]
    std = report.uncertainty.std[report.solution.layout.blocks["eye", "hand"]]
    assert distance_mm(X, recording.truth.T_mount_eye["hand"]) < 3.5e3 * np.linalg.norm(std[:3])
    assert 0.05 < report.held_out_px < 1
    assert report.held_out_mm < 0.2
    assert all(view.used and view.rms_px < 0.1 for view in report.views)
    assert any("joint_6 offset cannot be told from T_flange_hand" in w for w in report.warnings)
    (size,) = report.sizes
    assert size.factor == pytest.approx(1, abs=4 * size.std)
    assert not size.wrong


def test_the_cells_two_boards_in_one_solve() -> None:
    recording = draw_recording(1, replace(REAL, views=14, boards=("hand", "tripod")))
    report = calibrate(recording.problem, PLAIN)
    assert report.verdict == "ok"
    assert report.solution is not None
    for name, T in recording.truth.T_mount_fixture.items():
        assert distance_mm(report.solution.estimate.T_mount_fixture[name], T) < 0.5


def test_a_wrong_size_is_measured_by_the_arm() -> None:
    recording = draw_recording(2, replace(REAL, scale=0.977))
    report = calibrate(recording.problem, PLAIN)
    assert report.verdict == "suspect"
    (size,) = report.sizes
    assert size.wrong
    assert abs(size.factor - 0.977) < 4 * size.std < 0.01
    assert "0.97" in report.reasons[0]
    assert "tabletarget" in report.reasons[0]
    assert report.solution is not None
    X = report.solution.estimate.T_mount_eye["hand"]
    assert distance_mm(X, recording.truth.T_mount_eye["hand"]) < 1.0  # and is used


def test_supplied_intrinsics_without_the_distortion_are_contradicted() -> None:
    recording = draw_recording(3, replace(REAL, distortion=(-0.2, 0.05, 0, 0, 0)))
    true = recording.truth.cameras["hand"]
    eye = Eye("hand", Camera(true.K, true.width, true.height), "flange", refine=False)
    report = calibrate(replace(recording.problem, eyes=(eye,)))
    assert report.verdict in ("suspect", "refused")
    assert any("supplied intrinsics are contradicted" in r for r in report.reasons)
    kept = Eye("hand", true, "flange", refine=False)
    assert calibrate(replace(recording.problem, eyes=(kept,))).verdict == "ok"


def test_swapped_poses_are_found_and_named() -> None:
    recording = draw_recording(4, replace(REAL, views=15))
    views = list(recording.problem.views)
    a, b = views[3], views[9]
    views[3] = replace(a, T_base_flange=b.T_base_flange, q=None)
    views[9] = replace(b, T_base_flange=a.T_base_flange, q=None)
    report = calibrate(replace(recording.problem, views=tuple(views), arm=None), PLAIN)
    assert report.verdict == "suspect"
    unused = {view.id: view.reason for view in report.views if not view.used}
    assert set(unused) == {"v03", "v09"}
    assert "fits the arm pose of view 'v09'" in unused["v03"]
    assert "fits the arm pose of view 'v03'" in unused["v09"]
    assert report.held_out_px < 1


def test_a_disturbed_view_is_an_outlier() -> None:
    recording = draw_recording(5, replace(REAL, views=15))
    views = [replace(v, q=None) for v in recording.problem.views]
    knocked = views[6].T_base_flange * from_rvec([0, 0.02, 0], [0.004, 0, 0])
    views[6] = replace(views[6], T_base_flange=knocked)
    report = calibrate(replace(recording.problem, views=tuple(views), arm=None), PLAIN)
    assert [view.id for view in report.views if not view.used] == ["v06"]
    assert "does not fit" in report.reasons[0]


def test_even_boards_read_either_way_make_no_difference() -> None:
    conditions = replace(REAL, half_turns=True)
    recording = draw_recording(6, conditions)
    rng = np.random.default_rng(0)
    views = [
        replace(v, sights=(replace(s, uv_px=s.uv_px[::-1]) if rng.random() < 0.5 else s,))  # type: ignore[union-attr, type-var]
        for v in recording.problem.views
        for s in v.sights
    ]
    report = calibrate(recording.problem.with_views(views), PLAIN)
    assert report.verdict == "ok"
    assert report.solution is not None
    X = report.solution.estimate.T_mount_eye["hand"]
    assert distance_mm(X, recording.truth.T_mount_eye["hand"]) < 0.5


def pose_pairs(mount: str, rng: np.random.Generator) -> Problem:
    """An eye on the base that reports poses of an object on the flange, read as `mount` says."""
    X, Y = from_rvec([0.1, 2.0, 0], [0.6, -0.2, 0.8]), from_rvec([0, 0, 1], [0, 0.02, 0.1])
    views = []
    for k in range(20):
        A = from_rvec(rng.uniform(-0.8, 0.8, 3), rng.uniform(-0.2, 0.2, 3))
        noise = from_rvec(2e-3 * rng.standard_normal(3), 1e-3 * rng.standard_normal(3))
        views.append(CalibrationView(f"{k}", A, (PoseSight("c", "o", X.actInv(A * Y) * noise),)))
    other = "flange" if mount == "base" else "base"
    return Problem((Eye("c", None, mount),), (Fixture("o", mount=other),), tuple(views))  # type: ignore[arg-type]


def test_pose_pairs_are_solved_and_the_wrong_mount_is_refused(rng: np.random.Generator) -> None:
    seed = int(rng.integers(100))
    report = calibrate(pose_pairs("base", np.random.default_rng(seed)))
    assert report.verdict == "ok"
    assert report.solution is not None
    place = report.solution.estimate.T_mount_eye["c"].translation
    np.testing.assert_allclose(place, [0.6, -0.2, 0.8], atol=2e-3)
    assert np.isnan(report.held_out_px)
    wrong = calibrate(pose_pairs("flange", np.random.default_rng(seed)))
    assert wrong.verdict == "refused"


def test_nothing_seen_is_refused() -> None:
    problem = draw_recording(0, REAL).problem
    blank = problem.with_views([replace(v, sights=()) for v in problem.views])
    report = calibrate(blank)
    assert report.verdict == "refused"
    assert "no view shows a target" in report.reasons[0]
    assert not any(view.used for view in report.views)


def verdict_on_bad(case: int, config: CalibrationConfig) -> str:
    rng = np.random.default_rng([case, 99])
    conditions = Conditions(
        views=int(rng.integers(8, 16)),
        repeat_mm=float(rng.choice([0, 0.02, 0.1])),
        repeat_deg=0.003,
        joint_deg=float(rng.choice([0, 0.02, 0.1])),
        origin_mm=0.2,
        sigma_px=float(rng.choice([0.05, 0.2])),
    )
    bad = spoil(draw_recording(case, conditions), BAD[case % len(BAD)], rng)
    try:
        report = calibrate(bad(), config)
    except InputError:
        return "input"
    assert report.reasons or report.verdict == "ok"
    return report.verdict


def test_bad_recordings_are_never_ok() -> None:
    verdicts = Counter(verdict_on_bad(case, PLAIN) for case in range(len(BAD)))
    assert verdicts["ok"] == 0
    assert verdicts["input"] == 3


@pytest.mark.slow
def test_five_hundred_bad_recordings_are_never_ok() -> None:
    verdicts = Counter(verdict_on_bad(case, CalibrationConfig()) for case in range(504))
    assert verdicts["ok"] == 0
