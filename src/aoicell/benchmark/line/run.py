"""Runs a line board by board, and keeps every board that is done."""

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from aoicell.benchmark.line.conveyor import Conveyor, SetUp
from aoicell.benchmark.line.records import BoardRecord
from aoicell.benchmark.line.scoring import score_board
from aoicell.benchmark.line.settings import LineSettings
from aoicell.benchmark.line.store import LineStore, LineWriter
from aoicell.benchmark.line.summary import summarise
from aoicell.errors import InputError, Interrupted

Recalibrate = Literal["auto", "ask", "never"]
Ask = Callable[[BoardRecord], bool]
Report = Callable[[BoardRecord | str], None]


def run_line(
    settings: LineSettings,
    folder: Path,
    boards: int,
    recalibrate: Recalibrate = "never",
    report: Report = lambda news: None,
    ask: Ask = lambda record: False,
    resume: bool = False,
) -> dict[str, Any]:
    """Let boards 0 to `boards` - 1 pass, leave the folder behind and return its summary.

    `report` hears of every board, and of what takes long. Where the monitor wants it the cell is
    calibrated and taught again by itself, never, or when `ask` says so. `resume` goes on with what
    lies in `folder`, and gives the same as a line that was never stopped.

    Raises InputError for a folder of another line, and Interrupted on Ctrl-C.
    """
    store = LineStore(folder)
    if resume and store.exists:
        _refuse_others(store, settings)
    else:
        store.create(settings)
    try:
        if len(store.boards()) < boards:
            with closing(Conveyor(settings)) as conveyor, store.writing() as writer:
                _Line(conveyor, store, writer, report).run(boards, recalibrate, ask)
    except KeyboardInterrupt:
        done = len(store.boards())
        raise Interrupted(
            f"stopped after {done} of {boards} boards, which are kept in {folder}; --resume goes on"
        ) from None
    summary = summarise(settings, store)
    store.write_json("summary.json", summary)
    return summary


def _refuse_others(store: LineStore, settings: LineSettings) -> None:
    stored = store.settings()
    for key in LineSettings.model_fields:
        before, now = getattr(stored, key), getattr(settings, key)
        if before != now:
            raise InputError(
                f"--resume: {store.folder} holds a line with '{key}' = {before!r}, not {now!r}; "
                "give the same options, or another folder with --out"
            )


class _Line:
    """A line under way: which slot and board come next, and the set-up that is in use."""

    def __init__(
        self, conveyor: Conveyor, store: LineStore, writer: LineWriter, report: Report
    ) -> None:
        self._conveyor, self._store, self._writer, self._report = conveyor, store, writer, report
        self._done = store.boards()

    def run(self, boards: int, recalibrate: Recalibrate, ask: Ask) -> None:
        last = self._done[-1] if self._done else None
        number, slot = (0, -1) if last is None else (last.number + 1, last.slot + 1)
        set_up = None
        if last is not None and not last.set_up_next:
            set_up = self._set_up_again(last)
        while number < boards:
            if set_up is None:
                self._report("calibrating and teaching")
                set_up = self._conveyor.set_up(slot, number)
                self._writer.add_set_up(set_up.record)
                slot += 1
            record = self._board(set_up, slot, number)
            wanted = _wants_set_up(record)
            again = wanted and (recalibrate == "auto" or (recalibrate == "ask" and ask(record)))
            record = replace(record, set_up_next=again)
            self._writer.add_board(record)
            self._report(record)
            set_up = None if again else set_up
            number, slot = number + 1, slot + 1

    def _set_up_again(self, last: BoardRecord) -> SetUp:
        """The set-up that was in use, and the monitor as it was. Raises InputError."""
        self._report("calibrating and teaching as before")
        stored = next(s for s in self._store.set_ups() if s.slot == last.set_up)
        set_up = self._conveyor.set_up(stored.slot, stored.before_board)
        if set_up.record.readings != stored.readings:
            raise InputError(
                f"--resume: {self._store.folder}: the set-up before board {stored.before_board} "
                "does not give the same numbers here; go on with the version, libraries and "
                "machine that the line was begun with, or start anew"
            )
        for record in self._done:
            if record.set_up == last.set_up:
                set_up.station.monitor.recall(record.reading, record.cause)
        return set_up

    def _board(self, set_up: SetUp, slot: int, number: int) -> BoardRecord:
        population = self._conveyor.bring(slot, number, set_up.session)
        inspected = set_up.station.process()
        return score_board(self._conveyor, set_up, slot, number, population, inspected)


def _wants_set_up(record: BoardRecord) -> bool:
    """Whether the monitor asks for a new calibration."""
    return any(alarm.level == "recalibrate" for alarm in record.alarms)
