"""Run directories for the tests of the page, and the page as a parsed text."""

from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from benchmark.records_by_hand import refused, stored, trial, view, world

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.summary import summarise
from aoicell.report.page import draw, render
from aoicell.report.page_data import read_run
from aoicell.scenario import Scenario

METHODS = ("paper", "aoicell")
_VOID = {"meta", "img", "input", "br", "link"}


class Page(HTMLParser):
    """The page's elements, and its text outside of scripts; every tag has to be closed."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.raw, self.text = html, ""
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self._open: list[str] = []
        self.feed(html)
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in _VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not {"script", "style"} & set(self._open):
            self.text += data.replace("\u00a0", " ")

    def values(self, attribute: str) -> list[str]:
        return [attrs[attribute] or "" for _, attrs in self.elements if attribute in attrs]

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.elements)


def page_without_figures(store: RunStore) -> Page:
    """What the page says; drawing takes the most time."""
    return Page(render(read_run(store), store, {}))


def whole_page(store: RunStore) -> Page:
    """The page with its figures, which are not written to files."""
    run = read_run(store)
    return Page(render(run, store, draw(run, store)))


def finished(folder: Path, trials: list[TrialRecord], **changes: Any) -> RunStore:
    """A run directory that came to its end, with two worlds."""
    values = {"name": "s", "seed": 3, "methods": [*METHODS], "worlds": 2, "trials_per_world": 3}
    scenario = Scenario(**{**values, **changes})
    store = stored(folder, trials, [world(0, 0.03), world(1, 0.05)], scenario)
    store.write_json("summary.json", summarise(scenario, store, 2.5, 0.4))
    return store


def records(count: int = 6, each: int = 3) -> list[TrialRecord]:
    """Trials of both methods: in trial k aoicell leaves 0.15 (k + 1) mm, paper ten times it."""
    return [
        trial(
            number % each, method, number=number, world=number // each,
            displacement_mm=40.0 + number, turn_deg=float(number),
            views=[view("V1", mm, (10 * mm,)), view("V2", 2 * mm, (20 * mm, None))],
        )
        for number in range(count)
        for method, mm in zip(METHODS, (1.0 * (number + 1), 0.1 * (number + 1)), strict=True)
    ]  # fmt: skip


def last_refused(reason: str = "marker M1 is missing") -> list[TrialRecord]:
    """The same with aoicell's last trial refused."""
    others = [r for r in records() if (r.number, r.method) != (5, "aoicell")]
    changed = {"number": 5, "trial": 2, "world": 1, "reason": reason}
    return [*others, TrialRecord(**{**vars(refused(5, "aoicell")), **changed})]


def add_pictures(store: RunStore, trials: list[TrialRecord]) -> None:
    """Grey pictures, brighter where they are new."""
    store.images.mkdir(exist_ok=True)
    for record in trials:
        for seen in record.views:
            new = store.image_path(record.world, seen.id, record.trial, record.method)
            for path, grey in ((store.image_path(record.world, seen.id), 60), (new, 200)):
                cv2.imwrite(str(path), np.full((120, 160), grey, np.uint8))


def pictured(folder: Path, trials: list[TrialRecord], **changes: Any) -> RunStore:
    """A finished run that kept its pictures."""
    store = finished(folder, trials, **changes)
    add_pictures(store, trials)
    return store
