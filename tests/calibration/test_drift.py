"""A drift check with known truth: what was knocked is found, and nothing is found in nothing."""

from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from helpers.recorded import Conditions, Recording, cell, draw_recording

from aoicell.calibration.drift import DriftReport, check_drift
from aoicell.calibration.drift_groups import ARM, CAMERA, CENTRE, FOCAL, PRINT, TARGET
from aoicell.calibration.drift_reference import Reference, reference_of
from aoicell.calibration.parameters import Model
from aoicell.calibration.problem import CalibrationView, Fixture, PoseSight, Problem, Sight
from aoicell.calibration.selection import fit
from aoicell.calibration.starts import sight_poses, start_estimate
from aoicell.calibration.uncertainty import uncertainty_of
from aoicell.errors import InputError
from aoicell.transforms import SE3, Array, translation

CELL = Conditions(views=12, repeat_mm=0.02, repeat_deg=0.003, joints_known=False)
STILL = np.zeros(6)


@dataclass(frozen=True)
class Change:
    """What happened overnight: twists in the part's own axes, a factor, px."""

    knock: Array = field(default_factory=lambda: STILL)
    target: Array = field(default_factory=lambda: STILL)
    focal: float = 1.0
    centre_px: float = 0.0
    size: float = 1.0


@cache
def calibrated(seed: int, conditions: Conditions = CELL) -> tuple[Recording, Reference]:
    recording = draw_recording(seed, conditions)
    posed = sight_poses(recording.problem)
    start = start_estimate(posed.problem, posed.poses, posed.rms_px)
    solution = fit(posed.problem, Model("k1k2p1p2", "per_view"), start.estimate, start.noise)
    return recording, reference_of(solution, uncertainty_of(solution))


def seen_today(
    recording: Recording, change: Change = Change(), seed: int = 0, views: int = 5,
    flanges: list[SE3] | None = None, sigma_px: float = 0.05,
) -> Problem:  # fmt: skip
    """New views of a recording's cell after a change, at poses that it does not contain."""
    rng, truth, problem = np.random.default_rng([seed, 815]), recording.truth, recording.problem
    camera, c = truth.cameras["hand"], CELL
    K = np.array(camera.K)
    K[[0, 1], [0, 1]] *= change.focal
    K[0, 2] += change.centre_px
    today = replace(
        truth,
        cameras={"hand": replace(camera, K=K)},
        T_mount_eye={"hand": truth.T_mount_eye["hand"] * pin.exp6(change.knock)},
        T_mount_fixture={
            "tabletarget": truth.T_mount_fixture["tabletarget"] * pin.exp6(change.target)
        },
        scales={"tabletarget": change.size},
    )
    taken = []
    for k, T in enumerate(flanges or [cell().arm.fk(q) for q in recording.unused_q[:views]]):
        spread = [c.repeat_mm / 1e3] * 3 + [np.radians(c.repeat_deg)] * 3
        uv = today.sees(problem, "hand", "tabletarget", T * pin.exp6(spread * rng.normal(size=6)))
        uv = uv + sigma_px * rng.standard_normal(uv.shape)
        sight = Sight("hand", "tabletarget", np.arange(len(uv)), uv)
        taken.append(CalibrationView(f"today {k}", T, (sight,)))
    return replace(problem, views=tuple(taken), arm=None)


def checked(change: Change, seed: int = 0, fixed: bool = False, views: int = 5) -> DriftReport:
    recording, reference = calibrated(seed)
    return check_drift(seen_today(recording, change, seed, views), reference, fixed)


def changed(report: DriftReport, name: str) -> tuple[Array, Array]:
    assert report.verdict == "drifted"
    assert report.changed is not None
    assert report.changed.name == name, report.reasons
    return report.changed.values, np.sqrt(np.diag(report.changed.covariance))


TURN = np.array([0, 0, 0, *np.radians([0.2, -0.2, 0.1])])  # 0.3 deg
SHIFT = np.array([0.6e-3, 0.6e-3, -0.53e-3, 0, 0, 0])  # 1 mm


@pytest.mark.parametrize("knock", [TURN, SHIFT])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_knock_of_the_camera_is_found_with_its_size(knock: Array, seed: int) -> None:
    report = checked(Change(knock=knock), seed)
    values, std = changed(report, CAMERA)
    assert (np.abs(values - knock) < 4 * std).all()
    assert (std[:3] < 0.2e-3).all()
    assert (std[3:] < np.radians(0.03)).all()
    assert "moved" in report.reasons[0]
    assert "mm" in report.reasons[0]


@pytest.mark.parametrize("seed", [0, 1])
def test_a_longer_focal_length_is_found_with_its_size(seed: int) -> None:
    values, std = changed(checked(Change(focal=1.003), seed), FOCAL)
    assert abs(values[0] - 0.003) < 4 * std[0]
    assert std[0] < 3e-4


def test_a_moved_principal_point_and_a_swapped_print_are_told_apart() -> None:
    values, _ = changed(checked(Change(centre_px=30), views=8), CENTRE)
    assert values[0] == pytest.approx(30, abs=5)
    changed(checked(Change(size=1.004), views=8), PRINT)


def test_the_error_at_the_target_is_what_the_knock_does_there() -> None:
    recording, _ = calibrated(0)
    for knock in (TURN, SHIFT):
        report = checked(Change(knock=knock))
        problem, truth = seen_today(recording), recording.truth
        middle = problem.fixture("tabletarget").points.mean(axis=0)
        done = []
        for view in problem.views:
            E = view.T_base_flange * truth.T_mount_eye["hand"]
            x = E.actInv(truth.T_mount_fixture["tabletarget"]).act(middle)
            done.append(np.linalg.norm(pin.exp6(knock).act(x) - x) * 1e3)
        assert report.effect is not None
        expected = float(np.sqrt(np.mean(np.square(done))))
        assert abs(report.effect.rms_mm - expected) < 4 * report.effect.std_mm
        assert report.effect.std_mm < 0.2 * expected


def test_a_moved_target_is_no_alarm_but_measured() -> None:
    away = np.array([0.02, -0.03, 0.001, 0.02, 0.01, 0.3])
    report = checked(Change(target=away))
    assert report.verdict == "ok", report.reasons
    values, std = report.moved["tabletarget"]
    assert (np.abs(pin.log6(pin.exp6(away).actInv(pin.exp6(values))).vector) < 5 * std).all()
    changed(checked(Change(target=away), fixed=True), TARGET)


def test_false_alarms_are_as_rare_as_stated() -> None:
    """The truth drawn a hundred times as the old calibration's covariance has it."""
    recording, calibration = calibrated(0)
    reference = with_exact_print(calibration)
    rng, alarms, chances = np.random.default_rng(5), 0, []
    for seed in range(100):
        e = rng.multivariate_normal(np.zeros(len(reference.names)), reference.covariance)
        today = seen_today(off_by(recording, reference, e), seed=seed)
        report = check_drift(today, reference)
        alarms += report.verdict == "drifted"
        chances += [t.p for t in report.tests if t.name in (CAMERA, FOCAL)]
    assert alarms <= 4  # of 100, 1 wanted: more than 4 come once in 300 times
    assert 0.35 < np.mean(chances) < 0.65  # and the chances are spread as they should be


def with_exact_print(reference: Reference) -> Reference:
    """What the covariance is once the print is known to be as drawn."""
    C = reference.covariance
    b = [i for i, name in enumerate(reference.names) if name.startswith("tabletarget ")]
    conditioned = C - C[:, b] @ np.linalg.solve(C[np.ix_(b, b)], C[b])
    conditioned[b], conditioned[:, b] = 0, 0
    exact = dict.fromkeys(reference.scales, 1.0)
    return replace(reference, scales=exact, forms={}, covariance=conditioned)


def off_by(recording: Recording, reference: Reference, e: Array) -> Recording:
    """A cell from whose truth the old calibration is off by -e, as the names say."""
    off = dict(zip(reference.names, e, strict=True))
    camera, truth = reference.camera, recording.truth
    assert camera is not None
    K, distortion = np.array(camera.K), np.array(camera.distortion)
    K[[0, 1, 0, 1], [0, 1, 2, 2]] += [off[f"hand {n}"] for n in ("fx", "fy", "cx", "cy")]
    distortion[:4] += [off[f"hand {n}"] for n in ("k1", "k2", "p1", "p2")]
    twist = [off[f"T_flange_hand {n}"] for n in ("x", "y", "z", "rx", "ry", "rz")]
    as_it_is = replace(
        truth,
        cameras={"hand": replace(camera, K=K, distortion=distortion)},
        T_mount_eye={"hand": reference.T_mount_eye * pin.exp6(np.array(twist))},
    )
    return replace(recording, truth=as_it_is)


@pytest.mark.slow
def test_false_alarms_over_a_hundred_calibrated_cells() -> None:
    """Everything drawn anew a hundred times, with a moved target; calibrated each time."""
    alarms = 0
    for seed in range(100):
        recording, reference = calibrated.__wrapped__(seed)
        away = Change(target=np.array([0.02, 0.01, 0, 0, 0, 0.2]))
        alarms += check_drift(seen_today(recording, away, seed), reference).verdict == "drifted"
    assert alarms <= 4


def test_one_view_cannot_tell_unless_the_target_is_fixed() -> None:
    for knock in (STILL, TURN):
        report = checked(Change(knock=knock), views=1)
        assert report.verdict == "cannot tell"
        assert "three or more poses" in report.reasons[0]
    assert checked(Change(knock=TURN), views=1, fixed=True).verdict == "drifted"


def test_views_about_one_axis_cannot_tell_and_the_missing_tilt_is_named() -> None:
    recording, reference = calibrated(0)
    first = cell().arm.fk(recording.unused_q[0])
    eye = recording.truth.T_mount_eye["hand"]
    board = (first * eye).actInv(recording.truth.T_mount_fixture["tabletarget"])
    about = eye * translation(*board.translation)  # turning there keeps the board in the picture
    flanges = [
        first * about * SE3(pin.exp3(np.array([0, 0, a])), np.zeros(3)) * about.inverse()
        for a in (-0.4, -0.2, 0.0, 0.3)
    ]
    report = check_drift(seen_today(recording, flanges=flanges), reference)
    assert report.verdict == "cannot tell"
    assert "tilted about an axis across it" in report.reasons[0]


def test_no_view_cannot_tell() -> None:
    recording, reference = calibrated(0)
    report = check_drift(replace(recording.problem, views=(), arm=None), reference)
    assert report.verdict == "cannot tell"
    assert "no view" in report.reasons[0]


def test_mixed_up_poses_are_the_robots_fault() -> None:
    recording, reference = calibrated(0)
    problem = seen_today(recording, views=6)
    poses = [view.T_base_flange for view in problem.views]
    views = [
        replace(v, T_base_flange=T)
        for v, T in zip(problem.views, poses[1:] + poses[:1], strict=True)
    ]
    report = check_drift(problem.with_views(views), reference)
    assert report.verdict == "drifted"
    assert any("poses that do not belong together" in reason for reason in report.reasons)
    assert next(t for t in report.tests if t.name == ARM).p < 1e-6


def test_noisier_pictures_are_no_alarm_and_are_told() -> None:
    recording, reference = calibrated(0)
    report = check_drift(seen_today(recording, sigma_px=0.2), reference)
    assert report.verdict != "drifted"
    assert report.noise_ratio == pytest.approx(4, abs=0.5)


def test_an_even_board_read_the_other_way_round_has_not_moved() -> None:
    recording, reference = calibrated(0)
    problem = seen_today(recording)
    (board,) = problem.fixtures
    even = replace(problem, fixtures=(replace(board, half_turns=True),))
    last = len(board.points) - 1

    def turned(view: CalibrationView) -> CalibrationView:
        (sight,) = view.sights
        assert isinstance(sight, Sight)
        return replace(view, sights=(replace(sight, ids=last - sight.ids),))

    report = check_drift(even.with_views([turned(v) for v in even.views]), reference, fixed=True)
    assert report.verdict == "ok", report.reasons


def test_what_cannot_be_compared_is_named() -> None:
    recording, reference = calibrated(0)
    problem = seen_today(recording)
    (eye,) = problem.eyes
    with pytest.raises(InputError, match="stands on the base"):
        check_drift(replace(problem, eyes=(replace(eye, mount="base"),)), reference)
    views = tuple(
        CalibrationView(v.id, v.T_base_flange, (PoseSight("hand", "t", SE3.Identity()),))
        for v in problem.views
    )
    poses = Problem((replace(eye, camera=None),), (Fixture("t"),), views)
    with pytest.raises(InputError, match="both of pictures or both of poses"):
        check_drift(poses, reference)
