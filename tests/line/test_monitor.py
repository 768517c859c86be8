"""The drift monitor: what it reads is true, it is silent without a drift and speaks with one."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.benchmark.scoring import residual_vectors, visible_points
from aoicell.calibration.cell_model import CellModel
from aoicell.errors import InputError
from aoicell.line.drift_effect import left_at_targets
from aoicell.line.monitor import Alarm, Monitor, MonitorConfig
from aoicell.online import look, relocate
from aoicell.pipeline import METHODS
from aoicell.sim.drift import CellDrift, DriftRates
from aoicell.transforms import from_rvec, rotation
from line.cells import TaughtCell

MOVED_MM, MOVED_DEG = np.array([0.6, -0.4, 0.3]), np.array([0.05, 0.08, -0.06])
MOVED = from_rvec(np.radians(MOVED_DEG), MOVED_MM / 1e3)


def test_the_motion_of_the_camera_is_read_off_the_reference(taught_cell: TaughtCell) -> None:
    monitor = taught_cell.monitor(looks=10)
    taught_cell.move_camera(MOVED)
    for slot in range(30):  # until the moving average has arrived
        monitor.add(taught_cell.reading(monitor, slot))
    status = monitor.status
    std = np.array(status.motion_std)
    off = np.array(status.motion) - np.r_[MOVED_MM / 1e3, np.radians(MOVED_DEG), 0]
    assert (np.abs(off) < 4 * std + 1e-6).all()
    assert 1e3 * std[:3].max() < 0.04  # that is small beside what was moved
    assert np.degrees(std[3:6]).max() < 0.003


def test_a_cell_that_does_not_drift_raises_no_alarm(taught_cell: TaughtCell) -> None:
    monitor = taught_cell.monitor()
    for slot in range(40):
        assert monitor.add(taught_cell.reading(monitor, slot)) == ()
    assert monitor.status.mount < 1
    assert monitor.contradicted() == ()  # without a drift the board is the one to be looked at


def drifting(taught_cell: TaughtCell, monitor: Monitor, boards: int) -> list[tuple[int, Alarm]]:
    drift, found = CellDrift(taught_cell.world, DriftRates(mount_mm=2, mount_deg=0.3), 1), []
    for board in range(boards):
        taught_cell.move_camera(drift.T_camera_moved(board))
        reading = taught_cell.reading(monitor, board)
        found += [(board, alarm) for alarm in monitor.add(reading)]
    return found


def test_a_drift_is_warned_of_then_called_out_each_once(taught_cell: TaughtCell) -> None:
    (early, warning), (late, call) = drifting(taught_cell, taught_cell.monitor(), 20)
    assert early < late
    assert early <= 6
    assert (warning.level, warning.what) == ("warning", "mount")
    assert (call.level, call.what) == ("recalibrate", "mount")
    assert "camera mount: moved by (" in call.hint
    assert "calibrate and teach again" in call.hint


def test_what_is_wanted_of_the_targets_sets_the_second_alarm(taught_cell: TaughtCell) -> None:
    lax = taught_cell.monitor(config=MonitorConfig(tolerance_mm=50))
    assert [alarm.level for _, alarm in drifting(taught_cell, lax, 20)] == ["warning"]
    (alarm,) = lax.contradicted()  # but not where a board was refused for it
    assert alarm.level == "recalibrate"
    assert lax.contradicted() == ()


def test_the_same_readings_lead_to_the_same_state(taught_cell: TaughtCell) -> None:
    monitor = taught_cell.monitor()
    drifting(taught_cell, monitor, 6)
    again = Monitor(taught_cell.online)
    _, *rest = monitor._readings
    again.set_up(rest[:5])
    for reading in rest[5:]:
        again.recall(reading, "")
    again.recall(None, "reference_not_found")
    assert again.status == monitor.status
    assert again._alarms == monitor._alarms


@pytest.mark.parametrize("turn_deg", [0.0, 15.0, -15.0])
def test_what_a_drift_would_leave_is_what_it_leaves(
    taught_cell: TaughtCell, turn_deg: float
) -> None:
    """Against the truth, where nothing takes the drift out: a calibration without a covariance."""
    world, online = taught_cell.world, taught_cell.online
    turn, moved = float(np.radians(turn_deg)), MOVED * MOVED * MOVED  # beside it noise is small
    world.place_board(taught_cell.session.T_base_board_taught * rotation("z", turn))
    taught_cell.move_camera(moved)
    plain = replace(online, calibration=replace(online.calibration, model=None))
    correction = relocate(look(taught_cell.session.cell, plain), plain)
    truly = []
    for view, taught in zip(correction.views, online.template.views, strict=True):
        before = world.truth_of(taught.standard)
        world.arrive(view.q)
        points = visible_points(world, before)
        vectors = residual_vectors(before.T_camera_board, world.truth().T_camera_board, points)
        truly.append(np.sqrt((vectors**2).sum(axis=1).mean()))
    twist = np.r_[moved.translation, 3 * np.radians(MOVED_DEG), 0.0]
    said = left_at_targets(online, twist, [turn])[0]
    np.testing.assert_allclose(said, truly, atol=0.15e-3)
    assert min(truly) > 0.4e-3  # so that the agreement means something


def test_a_longer_focal_length_leaves_something_too(taught_cell: TaughtCell) -> None:
    """It makes the board seem nearer by so much of its distance, which the views then miss."""
    left = left_at_targets(taught_cell.online, np.r_[np.zeros(6), 1e-3])
    far = taught_cell.online.template.taught.T_camera_target.translation[2]
    assert left.min() == pytest.approx(1e-3 * far, rel=0.2)


def test_a_method_without_a_reference_is_not_monitored(taught_cell: TaughtCell) -> None:
    online, paper = taught_cell.online, METHODS["paper"]
    for without in (
        replace(online, method=paper, template=replace(online.template, references=())),
        replace(online, method=paper, calibration=replace(online.calibration, model=None)),
    ):
        with pytest.raises(InputError, match="method 'paper': it has no fixed reference"):
            Monitor(without)


def test_the_covariance_is_that_of_one_look(taught_cell: TaughtCell) -> None:
    """Stated rather too large than too small: false alarms come no oftener than they are to."""
    monitor = taught_cell.monitor()
    motions = np.array([taught_cell.reading(monitor, slot).motion for slot in range(60)])
    ratio = motions.std(axis=0, ddof=1) / np.sqrt(np.diag(monitor._covariance))
    assert ratio.max() < 1.25
    assert ratio.min() > 0.4
    assert isinstance(taught_cell.online.calibration.model, CellModel)
