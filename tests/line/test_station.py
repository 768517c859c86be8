"""A board at the station: what it says, and what it cannot know."""

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from aoicell.errors import Refused, TargetNotFound, Unreachable
from aoicell.inspection.findings import BoardInspection, Finding, Verdict
from aoicell.inspection.references import Reference
from aoicell.line.station import Station
from aoicell.observation import Image
from aoicell.transforms import from_rvec, from_xyz_rpy
from line.cells import TaughtCell

KNOCKED = from_rvec(np.radians([0.3, 0.2, 0.0]), [1e-3, 0, 0])


@dataclass
class Inspector:
    """Says of every board what it was told to, and remembers which views it was shown."""

    says: Verdict = "pass"
    shown: list[set[str]] = field(default_factory=list)

    def __call__(
        self, pictures: Mapping[str, Image], references: Mapping[str, Reference]
    ) -> BoardInspection:
        self.shown.append(set(pictures))
        state = {"pass": "present", "fail": "absent", "no_verdict": "no_verdict"}[self.says]
        finding = Finding("R1", state, reason="glare")  # type: ignore[arg-type]
        return BoardInspection(self.says, {"R1": finding}, (), {})


def station(taught_cell: TaughtCell, inspector: Inspector) -> Station:
    monitor = taught_cell.monitor()
    taught_cell.rewind()
    return Station(taught_cell.session.cell, taught_cell.online, monitor, {}, inspector)


@pytest.mark.parametrize("verdict", ["pass", "fail", "no_verdict"])
def test_the_verdict_is_that_of_the_inspection(taught_cell: TaughtCell, verdict: Verdict) -> None:
    inspector = Inspector(verdict)
    here = station(taught_cell, inspector)
    motion = from_xyz_rpy([0.03, 0.02, 0], [0, 0, 0])
    taught_cell.world.place_board(motion * taught_cell.session.T_base_board_taught)
    done = here.process()
    assert done.verdict == verdict
    assert inspector.shown == [{"V1", "V2", "V3", "V4"}]
    assert done.correction is not None
    assert done.correction.shift_mm == pytest.approx(np.hypot(30, 20), abs=0.3)
    assert done.reading is not None
    assert ("R1: glare" in done.reason) == (verdict == "no_verdict")
    assert done.compute_seconds > 0


def test_the_arm_makes_room_for_the_next_board(taught_cell: TaughtCell) -> None:
    station(taught_cell, Inspector()).process()
    np.testing.assert_array_equal(taught_cell.world.q_command, taught_cell.world.nominal.q_home)


def test_a_knocked_camera_gives_no_verdict_and_nothing_is_inspected(
    taught_cell: TaughtCell,
) -> None:
    inspector = Inspector("pass")
    here = station(taught_cell, inspector)
    taught_cell.move_camera(KNOCKED)
    done = here.process()
    assert (done.verdict, done.cause) == ("no_verdict", "contradicted")
    assert "camera, mount or chessboard have moved" in done.reason
    assert not inspector.shown
    # one such reading is enough of a drift for both alarms
    assert [alarm.level for alarm in done.alarms] == ["warning", "recalibrate"]


def test_a_view_that_was_not_taken_cannot_pass(
    taught_cell: TaughtCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    inspector = Inspector("pass")
    here = station(taught_cell, inspector)
    drive, q_third = taught_cell.world.drive, taught_cell.online.template.views[2].standard.state.q

    def with_an_obstacle(q: np.ndarray) -> None:
        if np.abs(np.asarray(q) - q_third).max() < 0.02:
            raise Unreachable("move: there is something in the way")
        drive(q)

    monkeypatch.setattr(taught_cell.world, "drive", with_an_obstacle)
    done = here.process()
    assert inspector.shown == [{"V1", "V2", "V4"}]
    assert done.verdict == "no_verdict"
    assert "V3: move: there is something in the way" in done.reason
    inspector.says = "fail"
    taught_cell.rewind()
    assert here.process().verdict == "fail"  # what is wrong is wrong all the same


def test_without_an_inspection_nothing_is_said(taught_cell: TaughtCell) -> None:
    monitor = taught_cell.monitor()
    taught_cell.rewind()
    done = Station(taught_cell.session.cell, taught_cell.online, monitor).process()
    assert (done.verdict, done.reason, done.cause) == ("no_verdict", "nothing was inspected", "")
    assert set(done.images) == {"V1", "V2", "V3", "V4"}


def test_the_station_gets_to_know_its_reference(taught_cell: TaughtCell) -> None:
    here = station(taught_cell, Inspector())
    readings = here.get_ready(4)
    assert len(readings) == 4
    assert len({reading.motion for reading in readings}) == 4  # the arm arrives anew each time
    assert here.monitor._first == 1 + 5 + 4


def test_a_taught_board_that_fails_is_refused(taught_cell: TaughtCell) -> None:
    here = station(taught_cell, Inspector("fail"))
    with pytest.raises(Refused, match=r"the taught board does not pass its own inspection \(R1\)"):
        here.get_ready(3)


def test_a_reference_out_of_sight_is_no_alarm(taught_cell: TaughtCell) -> None:
    """Then the correction goes without, or refuses; the monitor just has no reading."""
    here = station(taught_cell, Inspector())
    unseen = replace(taught_cell.online, detector=_Blind(taught_cell.online.detector))
    here._online = here.monitor._online = unseen
    done = here.process()
    assert done.reading is None
    assert done.alarms == ()
    assert (done.verdict, done.cause) == ("no_verdict", "reference_not_found")


class _Blind:
    """Finds no chessboard but the taught one."""

    def __init__(self, detector: object) -> None:
        self._detector = detector

    def chessboard(self, observation: object, board: object, name: str) -> object:
        if name == "reference":
            raise TargetNotFound("reference: covered")
        return self._detector.chessboard(observation, board, name)  # type: ignore[attr-defined]

    def __getattr__(self, name: str) -> object:
        return getattr(self._detector, name)


def test_the_station_knows_no_simulation() -> None:
    program = (
        "import sys, aoicell.line.station, aoicell.line.monitor;"
        "sys.exit(any(name.startswith('aoicell.sim') for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
