"""The worst trials' pictures: standard and new image of each view, and the markers' offsets."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from aoicell.benchmark.records import MarkerRecord, TrialRecord, ViewRecord
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.values import trial_values, view_values
from aoicell.report.page_data import RunData, case_name
from aoicell.report.page_svg import embedded_picture
from aoicell.report.page_table import number
from aoicell.report.pictures import magnification

MOST_BYTES = 6_000_000  # of all pictures; a page is to stay below 10 MB
TRIALS_EACH = 3  # of a method


@dataclass(frozen=True)
class Arrow:
    """A cross of a marker: where it was in the standard image, and its offset made longer, px."""

    x: float
    y: float
    to_x: float
    to_y: float


@dataclass(frozen=True)
class Comparison:
    """One view of one trial: two pictures of the same size (px), and the offsets on them."""

    name: str
    caption: str
    standard: str
    new: str
    width: int
    height: int
    arrows: list[Arrow]
    magnified: int


@dataclass(frozen=True)
class PicturedTrial:
    """A trial with its views, the one with the largest residual first."""

    title: str
    comparisons: list[Comparison]


def pictured_trials(
    run: RunData, store: RunStore, worst: Iterable[TrialRecord], used: int = 0
) -> list[PicturedTrial]:
    """Up to three trials a method among the worst, as long as there are pictures and room.

    `used`: how many bytes other pictures of the page take.
    """
    room, found, count = MOST_BYTES - used, [], dict.fromkeys(run.scenario.methods, 0)
    for record in worst:
        if count.get(record.method, 0) >= TRIALS_EACH:
            continue
        comparisons = list(_comparisons(store, record))
        size = sum(len(c.standard) + len(c.new) for c in comparisons)
        if not comparisons or size > room:
            continue
        room -= size
        count[record.method] = count.get(record.method, 0) + 1
        found.append(PicturedTrial(_title(run, record), comparisons))
    return found


def _title(run: RunData, record: TrialRecord) -> str:
    case = f"{case_name(run.cases[record.case])}, " if len(run.cases) > 1 else ""
    left = number(trial_values(record)["residual_mm"], 3)
    return (
        f"{record.method}, {case}trial {record.number} (world {record.world + 1}, test "
        f"{record.trial + 1}): {left} mm left of {record.displacement_mm:.1f} mm"
    )


def _comparisons(store: RunStore, record: TrialRecord) -> Iterator[Comparison]:
    """The views that both pictures were kept of, the worst first."""
    for view in sorted(record.views, key=lambda v: -v.residual_mm):
        standard = store.image_path(record.world, view.id, case=record.case)
        new = store.image_path(record.world, view.id, record.trial, record.method, record.case)
        if not (standard.is_file() and new.is_file()):
            continue
        before, width, height = embedded_picture(standard)
        magnified = magnification(view.markers)
        yield Comparison(
            view.id, _caption(view), before, embedded_picture(new)[0], width, height,
            [arrow for marker in view.markers for arrow in _arrows(marker, magnified)], magnified,
        )  # fmt: skip


def _caption(view: ViewRecord) -> str:
    values = view_values(view)
    px, mm = values["detected_px"], values["image_mm"]
    seen = "no marker detected" if px is None else f"markers {px:.2f} px = {number(mm, 3)} mm apart"
    return f"{view.id}: {view.residual_mm:.3f} mm left; {seen}"


def _arrows(marker: MarkerRecord, magnified: int) -> Iterator[Arrow]:
    if marker.standard_uv_px is None or marker.new_uv_px is None:
        return
    for before, after in zip(marker.standard_uv_px, marker.new_uv_px, strict=True):
        to = np.array(before) + magnified * (np.array(after) - np.array(before))
        yield Arrow(*(round(float(value), 1) for value in (*before, *to)))
