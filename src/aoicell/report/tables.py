"""Tables for the terminal: hand-eye, residuals by view and marker, the summary."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from rich.table import Table

from aoicell.benchmark.records import TrialRecord, WorldRecord
from aoicell.benchmark.summary import trial_mean, trial_px
from aoicell.report import paper


def _number(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _table(title: str, *columns: str) -> Table:
    """A table whose first column is text and whose other columns are numbers."""
    table = Table(title=title, title_justify="left")
    for index, column in enumerate(columns):
        table.add_column(column, justify="left" if index == 0 else "right", no_wrap=index == 0)
    return table


def hand_eye_table(worlds: Sequence[WorldRecord]) -> Table:
    """The estimated camera against the connector's design, as in the paper's Table 3."""
    table = _table(
        "Hand-eye against the connector's design (the paper's Table 3)",
        "", "dx mm", "dy mm", "dz mm", "turn deg", "error mm", "error deg",
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
        f"test {number} {unit}"
        for number in range(1, len(mine) + 1)
        for unit in ("px", "true px", "mm")
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
        _number(trial_px(trial, quantity))
        for trial in mine
        for quantity in ("detected_px", "true_px", "image_mm")
    ]
    table.add_row("mean", *means)
    for number, trial in enumerate(mine, start=1):
        if trial.outcome != "corrected":
            table.caption = f"test {number} was {trial.outcome}: {trial.reason}"
    return table


def summary_table(summary: dict[str, Any], trials: Sequence[TrialRecord]) -> Table:
    """What is left, method by method, with the paper's figures beside."""
    table = _table(
        "What is left after the correction (3D at the components, from truth; px at the markers)",
        "", "moved mm", "left mm", "lateral", "depth", "px", "compensated",
    )  # fmt: skip
    few = len({(t.world, t.trial) for t in trials}) <= 4
    if few:
        for number, test in enumerate(paper.TESTS, start=1):
            table.add_row(
                f"paper as printed, test {number}", f"{test.moved_mm:.1f}", f"{test.left_mm:.2f}",
                "-", "-", "-", f"{test.compensated_percent:.1f} %",
            )  # fmt: skip
    table.add_row(
        "paper as printed, mean", "-", f"{paper.MEAN_MM:.2f}", "-", "-", f"{paper.MEAN_PX:.2f}", "-"
    )
    for name, method in summary["methods"].items():
        table.add_section()
        if few:
            for trial in (t for t in trials if t.method == name):
                table.add_row(*_trial_row(trial))
        table.add_row(*_mean_row(name, method))
        if not few:
            table.add_row(*_percentile_row(name, method))
        if method["refused"] or method["failed"]:
            table.add_row(f"{name}: {method['refused']} refused, {method['failed']} failed")
    table.add_section()
    floor = _number(summary["arm_floor_mm"], 3)
    table.add_row("floor: two arrivals of the arm", "-", floor, "-", "-", "-", "-")
    return table


def _trial_row(trial: TrialRecord) -> Iterable[str]:
    name = f"{trial.method}, test {trial.trial + 1}"
    left = trial_mean(trial, "residual_mm")
    if left is None:
        return [f"{name}: {trial.outcome}", f"{trial.displacement_mm:.1f}", *["-"] * 5]
    compensated = 100 * (1 - left / trial.displacement_mm)
    return [
        name, f"{trial.displacement_mm:.1f}", _number(left, 3),
        _number(trial_mean(trial, "lateral_mm"), 3), _number(trial_mean(trial, "depth_mm"), 3),
        _number(trial_px(trial, "detected_px")), f"{compensated:.2f} %",
    ]  # fmt: skip


_COLUMNS = ("residual_mm", "residual_lateral_mm", "residual_depth_mm")


def _mean_row(name: str, method: dict[str, Any]) -> Iterable[str]:
    compensation = method["compensation"]
    return [
        f"{name}, mean of {method['corrected']}", _number(method["displacement_mm"]["mean"], 1),
        *(_number(method[column]["mean"], 3) for column in _COLUMNS),
        _number(method["residual_px"]["mean"]),
        "-" if compensation is None else f"{100 * compensation:.2f} %",
    ]  # fmt: skip


def _percentile_row(name: str, method: dict[str, Any]) -> Iterable[str]:
    return [
        f"{name}, 95th percentile", _number(method["displacement_mm"]["p95"], 1),
        *(_number(method[column]["p95"], 3) for column in _COLUMNS),
        _number(method["residual_px"]["p95"]), "-",
    ]  # fmt: skip
