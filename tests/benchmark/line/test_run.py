"""A line from its first board to its last: stopped, gone on with, calibrated again."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from aoicell.benchmark.line.records import BoardRecord
from aoicell.benchmark.line.run import run_line
from aoicell.benchmark.line.settings import LineSettings
from aoicell.benchmark.line.store import LineStore
from aoicell.errors import InputError, Interrupted

FAST = LineSettings(
    pictures=False, seed=2, mount_mm=3, mount_deg=0.4, set_up_looks=3
)  # a drift that is called out within a few boards
BOARDS = 6


def kept(folder: Path) -> list[dict[str, Any]]:
    """Boards and set-ups without the times that were measured."""
    store = LineStore(folder)
    records = [asdict(record) for record in [*store.boards(), *store.set_ups()]]
    for record in records:
        del record["compute_seconds"]
    return records


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The line without a break, calibrated again on the way."""
    folder = tmp_path_factory.mktemp("line") / "whole"
    run_line(FAST, folder, BOARDS, "auto")
    return folder


def test_it_is_warned_and_calibrated_again_and_goes_on(whole: Path) -> None:
    store, summary = LineStore(whole), json.loads((whole / "summary.json").read_text())
    boards = store.boards()
    assert [board.number for board in boards] == list(range(BOARDS))
    first, *others = summary["set_ups_before_board"]
    assert first == 0
    assert len(others) == 1  # a second one only after the first has done its work
    last = boards[others[0] - 1]
    assert last.set_up_next
    assert any(alarm.level == "recalibrate" for alarm in last.alarms)
    assert boards[others[0]].drifted_mm == 0
    assert boards[others[0]].residual_mm is not None
    assert boards[others[0]].residual_mm < 0.2
    # a slot is a board or a set-up, and none comes twice
    slots = sorted([b.slot for b in boards] + [s.slot for s in store.set_ups()])
    assert slots == list(range(-1, BOARDS + 1))
    assert summary["first_warning_board"] <= summary["first_recalibrate_board"]
    assert summary["cycle_seconds"]["arm"]["mean"] > 3
    assert summary["boards_per_hour"] < 3600 / 3


@pytest.mark.parametrize(
    "after",
    [
        pytest.param(1, marks=pytest.mark.slow, id="before the second set-up"),
        pytest.param(5, id="after it"),
    ],
)
def test_a_line_that_was_stopped_goes_on_to_the_same_bits(
    whole: Path, tmp_path: Path, after: int
) -> None:
    folder, news = tmp_path / "stopped", []

    def stop(record: BoardRecord | str) -> None:
        news.append(record)
        if isinstance(record, BoardRecord) and record.number == after - 1:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match=f"stopped after {after} of {BOARDS} boards.*--resume"):
        run_line(FAST, folder, BOARDS, "auto", stop)
    assert len(LineStore(folder).boards()) == after
    run_line(FAST, folder, BOARDS, "auto", resume=True)
    assert kept(folder) == kept(whole)


def test_another_line_is_not_gone_on_with(whole: Path) -> None:
    other = FAST.model_copy(update={"mount_mm": 1.0})
    with pytest.raises(InputError, match=r"'mount_mm' = 3.0, not 1.0"):
        run_line(other, whole, BOARDS, resume=True)


def test_a_line_that_is_done_is_not_run_again(whole: Path) -> None:
    before = kept(whole)
    run_line(FAST, whole, BOARDS, "auto", resume=True, report=lambda news: pytest.fail(str(news)))
    assert kept(whole) == before


def test_other_numbers_than_before_are_refused(whole: Path, tmp_path: Path) -> None:
    """As on another machine: what would follow would belong to another line."""
    folder = tmp_path / "moved"
    store, theirs = LineStore(folder), LineStore(whole)
    store.create(FAST)
    (set_up, *_), (board, *_) = theirs.set_ups(), theirs.boards()
    reading = replace(set_up.readings[0], motion=(1e-9,) * 7)
    with store.writing() as writer:
        writer.add_set_up(replace(set_up, readings=[reading, *set_up.readings[1:]]))
        writer.add_board(board)
    with pytest.raises(InputError, match="does not give the same numbers here"):
        run_line(FAST, folder, BOARDS, resume=True)


def test_whoever_is_asked_decides(tmp_path: Path) -> None:
    asked: list[int] = []

    def no(record: BoardRecord) -> bool:
        asked.append(record.number)
        return False

    fast = FAST.model_copy(update={"mount_mm": 20.0, "mount_deg": 2.0})
    summary = run_line(fast, tmp_path / "asked", 3, "ask", ask=no)
    assert asked == [summary["first_recalibrate_board"]]
    assert summary["set_ups_before_board"] == [0]
    assert summary["verdicts"]["no_verdict"] == 3
