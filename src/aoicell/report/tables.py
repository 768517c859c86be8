"""Tables for the terminal: hand-eye, residuals by view and marker, the summary."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from aoicell.benchmark.records import TrialRecord, WorldRecord
from aoicell.benchmark.values import trial_values
from aoicell.report import paper
from aoicell.report.inspection_numbers import notes, percent, rows, words


def _number(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _table(title: str, *columns: str) -> Table:
    """A table whose first column is text and whose other columns are numbers."""
    table = Table(
        title=title, title_justify="left", caption_justify="left",
        box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True,
    )  # fmt: skip
    for index, column in enumerate(columns):
        table.add_column(column, justify="left" if index == 0 else "right", no_wrap=True)
    return table


def hand_eye_table(worlds: Sequence[WorldRecord]) -> Table:
    """The estimated camera against the connector's design, as in the paper's Table 3."""
    table = _table(
        "Hand-eye against the connector's design (the paper's Table 3)",
        "", "dx\nmm", "dy\nmm", "dz\nmm", "turn\ndeg", "error\nmm", "error\ndeg",
    )  # fmt: skip
    x, z = f"about {paper.HAND_EYE_X_MM:.0f}", f"about {paper.HAND_EYE_Z_MM:.0f}"
    table.add_row("printed in the paper", x, "-", z, "-", "-", "-")
    for world in worlds[:3]:
        name = f"world {world.world + 1}: " if len(worlds) > 1 else ""
        truth = [_number(v) for v in world.hand_eyes[0].true_offset_mm]
        table.add_row(f"{name}as built (truth)", *truth, "-", "-", "-")
        for record in world.hand_eyes:
            turn = float(np.linalg.norm(record.design_deg))
            table.add_row(
                f"{name}{record.method}", *(_number(v) for v in record.design_mm),
                _number(turn), _number(record.error_mm), _number(record.error_deg, 3),
            )  # fmt: skip
    if len(worlds) > 3:
        table.caption = f"the first 3 of {len(worlds)} worlds"
    return table


def residual_table(trials: Sequence[TrialRecord], method: str) -> Table:
    """Distance of each measuring marker between standard and new image, as in Tables 4 and 5."""
    mine = [trial for trial in trials if trial.method == method]
    columns = [
        f"{_test(trial, mine)}\n{unit}" for trial in mine for unit in ("px", "true px", "mm")
    ]
    table = _table(f"{method}: markers in the new images (Tables 4 and 5)", "view", *columns)
    rows: dict[str, list[str]] = {}
    for index, trial in enumerate(mine):
        for view in trial.views:
            for marker in view.markers:
                row = rows.setdefault(f"{view.id} {marker.id}", ["-"] * len(columns))
                row[3 * index : 3 * index + 3] = [
                    _number(marker.detected_px), _number(marker.true_px), _number(marker.image_mm),
                ]  # fmt: skip
    for name, row in rows.items():
        table.add_row(name, *row)
    table.add_section()
    means = [
        _number(trial_values(trial)[quantity])
        for trial in mine
        for quantity in ("detected_px", "true_px", "image_mm")
    ]
    table.add_row("mean", *means)
    table.caption = _not_corrected(mine)
    return table


def _test(trial: TrialRecord, among: Sequence[TrialRecord]) -> str:
    """`test 1`, with the world where there are several."""
    world = f"world {trial.world + 1} " if len({other.world for other in among}) > 1 else ""
    return f"{world}test {trial.trial + 1}"


def _not_corrected(trials: Sequence[TrialRecord]) -> Text | None:
    """Every trial that ended otherwise, with its reason, literally: no markup in it."""
    lines = [
        f"{trial.method}, {_test(trial, trials)} was {trial.outcome}: {trial.reason}"
        for trial in trials
        if trial.outcome != "corrected"
    ]
    return Text("\n".join(lines)) if lines else None


def summary_table(summary: dict[str, Any], trials: Sequence[TrialRecord]) -> Table:
    """What is left, method by method, with the paper's figures beside.

    Single `trials` are listed where they are given: where they are few.
    """
    table = _table(
        "What is left after the correction",
        "", "moved\nmm", "left\nmm", "lateral\nmm", "depth\nmm", "image\nmm", "image\npx",
        "comp.\n%",
    )  # fmt: skip
    few = bool(trials)
    if few:
        for number, test in enumerate(paper.TESTS, start=1):
            table.add_row(
                f"paper as printed, test {number}", f"{test.moved_mm:.1f}", "-", "-", "-",
                f"{test.left_mm:.2f}", "-", f"{test.compensated_percent:.1f}",
            )  # fmt: skip
    table.add_row(
        "paper as printed, mean", "-", "-", "-", "-", f"{paper.MEAN_MM:.2f}",
        f"{paper.MEAN_PX:.2f}", "-",
    )  # fmt: skip
    for name, method in summary["methods"].items():
        table.add_section()
        if few:
            for trial in (t for t in trials if t.method == name):
                table.add_row(*_trial_row(trial, trials))
        table.add_row(*_mean_row(name, method))
        if not few:
            table.add_row(*_percentile_row(name, method))
    table.add_section()
    floor = _number(summary["arm_floor_mm"], 3)
    table.add_row("floor: the arm alone", "-", floor, *["-"] * 5)
    notes = [
        Text(
            "left, lateral, depth: from truth at component points; image: at the markers in the "
            "pictures, px and px times the local scale. The paper's mm are of the latter kind. "
            "comp.: the share of the displacement that is compensated. "
            "floor: two arrivals of the arm at the same target."
        )
    ]
    notes += [
        Text(f"{name}: {method['refused']} refused, {method['failed']} failed")
        for name, method in summary["methods"].items()
        if method["refused"] or method["failed"]
    ]
    refusals = _not_corrected(trials) if few else None
    table.caption = Text("\n").join([*notes, refusals] if refusals else notes)
    return table


def _trial_row(trial: TrialRecord, among: Sequence[TrialRecord]) -> Iterable[str]:
    name = f"{trial.method}, {_test(trial, among)}"
    values = trial_values(trial)
    left = values["residual_mm"]
    if left is None:
        return [f"{name}: {trial.outcome}", f"{trial.displacement_mm:.1f}", *["-"] * 6]
    columns = ("residual_mm", "lateral_mm", "depth_mm", "image_mm")
    return [
        name, f"{trial.displacement_mm:.1f}",
        *(_number(values[column], 3) for column in columns), _number(values["detected_px"]),
        f"{100 * (1 - left / trial.displacement_mm):.2f}",
    ]  # fmt: skip


_COLUMNS = ("residual_mm", "residual_lateral_mm", "residual_depth_mm", "image_mm")


def _mean_row(name: str, method: dict[str, Any]) -> Iterable[str]:
    compensation = method["compensation"]
    return [
        f"{name}, mean of {method['corrected']}", _number(method["displacement_mm"]["mean"], 1),
        *(_number(method[column]["mean"], 3) for column in _COLUMNS),
        _number(method["residual_px"]["mean"]),
        "-" if compensation is None else f"{100 * compensation:.2f}",
    ]  # fmt: skip


def _percentile_row(name: str, method: dict[str, Any]) -> Iterable[str]:
    return [
        f"{name}, 95th percentile", _number(method["displacement_mm"]["p95"], 1),
        *(_number(method[column]["p95"], 3) for column in _COLUMNS),
        _number(method["residual_px"]["p95"]), "-",
    ]  # fmt: skip


def cases_table(summary: dict[str, Any]) -> Table:
    """One row a case of a sweep: what each method leaves, and how often it declines."""
    methods = list(summary["methods"])
    columns = [f"{name}\n{what}" for name in methods for what in ("mm", "95 %", "px", "refused")]
    table = _table("Case by case: mean and 95th percentile of what is left", "", *columns)
    for case in summary["cases"]:
        cells = []
        for name in methods:
            method = case["methods"][name]
            declined = method["refused"] + method["failed"]
            cells += [
                _number(method["residual_mm"]["mean"], 3), _number(method["residual_mm"]["p95"], 3),
                _number(method["residual_px"]["mean"]), f"{declined} of {method['trials']}",
            ]  # fmt: skip
        table.add_row(f"{case['kind']} {case['label']}".strip(), *cells)
    return table


def inspection_tables(summary: dict[str, Any]) -> list[Table]:
    """What was inspected, a column a method: the headline numbers, and by kind of defect."""
    found = {name: method["inspection"] for name, method in summary["methods"].items()}
    headline = _table("The inspection of the same boards", "", *found, "goal")
    for row in rows(found):
        headline.add_row(row.name, *row.values, row.goal or "-")
    headline.caption = Text(notes())
    kinds = sorted({kind for inspection in found.values() for kind in inspection["by_kind"]})
    if not kinds:
        return [headline]
    columns = [f"{name}\n{what}" for name in found for what in ("found", "%")]
    by_kind = _table("Defects found, by kind", "", *columns)
    for kind in kinds:
        cells = []
        for inspection in found.values():
            counts = inspection["by_kind"].get(kind, {"defects": 0, "found": 0})
            cells += [
                f"{counts['found']} of {counts['defects']}",
                percent(counts["found"], counts["defects"]),
            ]
        by_kind.add_row(words(kind), *cells)
    return [headline, by_kind]
