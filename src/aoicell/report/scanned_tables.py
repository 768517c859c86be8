"""A scan in figures: for machines, and as tables for the terminal."""

from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.table import Table

from aoicell.benchmark.scan_trial import ScanTrial
from aoicell.transforms import Array


def described(trial: ScanTrial, crosses_px: Array) -> dict[str, Any]:
    """What a scan found and how far off it is; `crosses_px` (N,) are those of virtual images."""
    c, board = trial.comparison, trial.model.board
    return {
        "images": trial.images,
        "seconds": trial.seconds,
        "board": {
            "size_mm": [round(side * 1e3, 2) for side in board.size[:2]],
            "outline_rms_mm": round(board.rms * 1e3, 3),
            "pose_error_mm": round(trial.board_mm, 3),
            "pose_error_deg": round(trial.board_deg, 4),
        },
        "targets": {
            "designed": len(c.matches) + len(c.missed),
            "found": len(c.matches),
            "pieces": len(c.pieces),
            "extra": len(c.extra),
            "position_error_mm": _statistics(c.position_errors * 1e3),
            "height_error_mm": _statistics(np.abs(c.height_errors) * 1e3),
            "missed": [target.id for target in c.missed],
        },
        "virtual_crosses": len(crosses_px),
        "virtual_crosses_px": _statistics(crosses_px),
    }


def _statistics(values: Array) -> dict[str, float] | None:
    if not len(values):
        return None
    named = {
        "mean": values.mean(), "p50": np.median(values), "p95": np.percentile(values, 95),
        "max": values.max(),
    }  # fmt: skip
    return {name: round(float(value), 3) for name, value in named.items()}


def scan_tables(trial: ScanTrial, result: dict[str, Any]) -> list[Table]:
    """Targets by kind, and the whole."""
    return [_by_kind(trial), _whole(result)]


def _by_kind(trial: ScanTrial) -> Table:
    table = Table("kind", "found", "of", "position mm", "height mm", box=SIMPLE)
    table.title = "Targets of the scan against the design (mean errors of the found)"
    c = trial.comparison
    for kind in sorted({t.kind for t in c.missed} | {m.target.kind for m in c.matches}):
        found = [m for m in c.matches if m.target.kind == kind]
        missed = sum(t.kind == kind for t in c.missed)
        place, height = "-", "-"
        if found:
            place = f"{np.mean([np.hypot(*m.error) for m in found]) * 1e3:.2f}"
            height = f"{np.mean([abs(m.height_error) for m in found]) * 1e3:.2f}"
        table.add_row(kind, str(len(found)), str(len(found) + missed), place, height)
    return table


def _whole(result: dict[str, Any]) -> Table:
    targets, board, px = result["targets"], result["board"], result["virtual_crosses_px"]
    place, height = targets["position_error_mm"], targets["height_error_mm"]
    rows = {
        "depth images": str(result["images"]),
        "targets found": f"{targets['found']} of {targets['designed']}; further bumps: "
        f"{targets['pieces']} pieces of designed parts, {targets['extra']} of nothing",
        "position error mm (mean, 95 %)": f"{place['mean']}, {place['p95']}" if place else "-",
        "height error mm (mean, 95 %)": f"{height['mean']}, {height['p95']}" if height else "-",
        "board's size mm": " x ".join(f"{side:.2f}" for side in board["size_mm"]),
        "board's pose in base is off by": f"{board['pose_error_mm']} mm, "
        f"{board['pose_error_deg']} deg",
        "crosses found in virtual images": f"{result['virtual_crosses']}"
        + (f", off by {px['mean']} px in the mean" if px else ""),
        "seconds": ", ".join(f"{name} {value:.1f}" for name, value in result["seconds"].items()),
    }
    table = Table("what", "value", box=SIMPLE)
    for name, value in rows.items():
        table.add_row(name, value)
    return table
