"""Writes what was planned: views in the format of `targets.toml`, and tables as CSV."""

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.nominal import View
from aoicell.planning.table import CoverageTable
from aoicell.planning.views import ViewPlan

TARGET_COLUMNS = (
    "target kind state view features visible_share px_per_mm angle_deg margin_px reason".split()
)
COVERAGE_COLUMNS = (
    "target kind feature state view visible_share px_per_mm angle_deg margin_px blur_px reason"
).split()


def view_row(view: View) -> dict[str, Any]:
    """A view in the units of files: mm and degrees."""

    def rounded(values: Iterable[float], digits: int) -> list[float]:
        return [round(float(value), digits) + 0.0 for value in values]

    return {
        "id": view.id,
        "shows": view.shows,
        "aim_mm": rounded(np.array(view.aim[:2]) * 1e3, 3),
        "distance_mm": rounded([view.distance * 1e3], 3)[0],
        "tilt_deg": rounded(np.degrees(view.tilt), 4),
        "roll_deg": rounded([np.degrees(view.roll)], 4)[0],
    }


def views_text(views: Sequence[View], made_by: str) -> str:
    """The views as `aoicell.nominal.load_views` reads them; the first line says who made them."""
    tables = [f"# Made by `{made_by}`. A view is described in models/server_board/targets.toml.\n"]
    for view in views:
        pairs = [f"{key} = {json.dumps(value)}" for key, value in view_row(view).items()]
        tables.append("\n".join(["[[view]]", *pairs, ""]))
    return "\n".join(tables)


def described(views: Sequence[View], plan: ViewPlan, table: CoverageTable) -> list[View]:
    """The views with what they show in words."""
    found = []
    for view, markers in zip(views, plan.markers, strict=True):
        count = sum(row.view == view.id for row in table.targets)
        seen = f" and marker{'s' * (len(markers) > 1)} {', '.join(markers)}" if markers else ""
        found.append(replace(view, shows=f"{count} targets{seen}"))
    return found


def target_rows(table: CoverageTable) -> list[dict[str, Any]]:
    """A line for each component."""
    return [
        {
            "target": row.target, "kind": row.kind, "state": row.state, "view": row.view,
            "features": row.features, "reason": row.reason,
            **_figures(row.share, row.px_per_mm, row.angle_deg, row.margin_px, bool(row.view)),
        }
        for row in table.targets
    ]  # fmt: skip


def coverage_rows(table: CoverageTable) -> list[dict[str, Any]]:
    """A line for each feature."""
    rows = []
    for row in table.features:
        s = row.sight
        figures = (s.share, s.px_per_mm, s.angle_deg, s.margin_px) if s else (0.0, 0.0, 0.0, 0.0)
        rows.append({
            "target": row.target, "kind": row.kind, "feature": row.what, "state": row.state,
            "view": row.view, "reason": row.reason, **_figures(*figures, s is not None),
            "blur_px": f"{s.blur_px:.2f}" if s else "",
        })  # fmt: skip
    return rows


def _figures(
    share: float, px_per_mm: float, angle_deg: float, margin_px: float, shown: bool
) -> dict[str, str]:
    """Figures as they are printed; empty where there is no view."""
    if not shown:
        return dict.fromkeys(("visible_share", "px_per_mm", "angle_deg", "margin_px"), "")
    return {
        "visible_share": f"{share:.3f}",
        "px_per_mm": f"{px_per_mm:.3f}",
        "angle_deg": f"{angle_deg:.2f}",
        "margin_px": f"{margin_px:.1f}",
    }


def write_csv(path: Path, rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> None:
    """A table with a header."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
