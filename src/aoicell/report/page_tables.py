"""The tables of the page: by view, by marker, by case, refusals, hand-eye, worst trials."""

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from aoicell.benchmark.records import TrialRecord, WorldRecord
from aoicell.benchmark.statistics import statistics
from aoicell.benchmark.store import Columns
from aoicell.benchmark.values import trial_values
from aoicell.report import paper
from aoicell.report.page_data import RunData, case_name, choose
from aoicell.report.page_table import Column, Table, Value, make_table

MOST_ROWS = 40  # of refusals and of hand-eyes: more are for the store, not for a page
_METHOD = Column("method")


# -- By view and by marker --------------------------------------------------------------


def views_table(run: RunData) -> Table:
    """Each inspection view by each method: what is left there, and in which direction."""
    columns = [
        Column("view"), _METHOD, Column("trials", "", 0),
        Column("left", "mm", 3), Column("95 %", "mm", 3), Column("most", "mm", 3),
        Column("lateral", "mm", 3), Column("depth", "mm", 3), Column("turn", "deg", 3),
        Column("in picture", "px", 2), Column("in picture", "mm", 3),
        Column("x", "mm", 3), Column("y", "mm", 3), Column("z", "mm", 3),
    ]  # fmt: skip
    rows: list[list[Value]] = []
    for (view, method), mine in _groups(run.views, "view", "method"):
        left = statistics(mine["residual_mm"])
        names = ("lateral_mm", "depth_mm", "deg", "detected_px", "image_mm", "x_mm", "y_mm", "z_mm")
        means = [_mean(mine[name]) for name in names]
        rows.append([view, method, len(mine["view"]), left["mean"], left["p95"], left["max"],
                     *means])  # fmt: skip
    return make_table(
        "views", "Each inspection view", columns, rows,
        "Means over the corrected trials, 95 %: the percentile, most: the largest. x, y, z: the "
        "signed mean in the camera's axes (x to the right, y down, z along the optical axis); a "
        "mean far from zero is a systematic error.",
    )  # fmt: skip


def markers_table(run: RunData) -> Table:
    """Each marker in each view by each method, as the pictures show it."""
    columns = [
        Column("view"), Column("marker"), _METHOD, Column("seen in", "trials", 0),
        Column("missed in", "trials", 0), Column("detected", "px", 2), Column("95 %", "px", 2),
        Column("most", "px", 2), Column("by truth", "px", 2), Column("in picture", "mm", 3),
    ]  # fmt: skip
    rows: list[list[Value]] = []
    for (view, marker, method), mine in _groups(run.markers, "view", "marker", "method"):
        px = mine["detected_px"]
        seen, detected = int(np.isfinite(px).sum()), statistics(px)
        rows.append([view, marker, method, seen, len(px) - seen, detected["mean"], detected["p95"],
                     detected["max"], _mean(mine["true_px"]), _mean(mine["image_mm"])])  # fmt: skip
    return make_table(
        "markers", "Each marker in each view", columns, rows,
        "Mean distance of the marker's crosses between the standard and the new image: as they "
        "were detected, and as they lie by the truth. The mm are the detected pixels times the "
        "local scale, as in the paper's Table 5.",
    )  # fmt: skip


def _groups(columns: Columns, *names: str) -> Iterator[tuple[tuple[str, ...], Columns]]:
    """Rows with equal values under `names`, in the order of those."""
    codes = np.zeros(len(columns[names[0]]), dtype=int)
    kinds = []
    for name in names:
        found, inverse = np.unique(columns[name].astype(str), return_inverse=True)
        codes = codes * max(len(found), 1) + inverse
        kinds.append(columns[name])
    for code in np.unique(codes):
        rows = np.flatnonzero(codes == code)
        yield tuple(str(kind[rows[0]]) for kind in kinds), choose(columns, rows)


def _mean(values: Any) -> float | None:
    return statistics(values)["mean"]


# -- By case ----------------------------------------------------------------------------


def cases_table(run: RunData) -> Table:
    """One row a case and method."""
    columns = [
        Column("case"), _METHOD, Column("trials", "", 0), Column("refused", "", 0),
        Column("failed", "", 0), Column("silently wrong", "", 0), Column("moved", "mm", 1),
        Column("left", "mm", 3), Column("95 %", "mm", 3), Column("most", "mm", 3),
        Column("in picture", "px", 2), Column("in picture", "mm", 3),
    ]  # fmt: skip
    rows: list[list[Value]] = []
    for case, summary in zip(run.cases, run.by_case, strict=True):
        for name, method in summary["methods"].items():
            left = method["residual_mm"]
            rows.append([
                case_name(case), name, method["trials"], method["refused"], method["failed"],
                method["silent_wrong"], method["displacement_mm"]["mean"], left["mean"],
                left["p95"], left["max"], method["residual_px"]["mean"],
                method["image_mm"]["mean"],
            ])  # fmt: skip
    return make_table(
        "cases", "Case by case", columns, rows,
        "All cases share their draws: what differs between them is what was changed.",
    )  # fmt: skip


# -- Refusals ---------------------------------------------------------------------------


def refusals_table(run: RunData) -> Table:
    """Refused and failed trials by reason, over all cases; numbers in a reason do not divide it."""
    columns = [
        _METHOD, Column("outcome"), Column("reason"), Column("trials", "", 0),
        Column("share", "%", 1), Column("moved from", "mm", 1), Column("to", "mm", 1),
        Column("such as trial", "", 0),
    ]  # fmt: skip
    trials = run.trials
    ended = choose(trials, trials["outcome"] != "corrected")
    alike = np.array([_NUMBER.sub("…", reason) for reason in ended["reason"]], dtype=object)
    rows: list[list[Value]] = []
    for (method, outcome, kind), mine in _groups(
        {**ended, "alike": alike}, "method", "outcome", "alike"
    ):
        count, moved = len(mine["reason"]), mine["displacement_mm"]
        one = len(set(mine["reason"])) == 1
        among = int((trials["method"] == method).sum())
        rows.append([method, outcome, str(mine["reason"][0]) if one else kind, count,
                     100 * count / among, float(moved.min()), float(moved.max()),
                     int(mine["number"][0])])  # fmt: skip
    rows.sort(key=lambda row: -float(row[3] or 0))
    return make_table(
        "refusals", "Refused and failed trials, by reason", columns, rows[:MOST_ROWS],
        _cut(len(rows), "reasons, those with the most trials"),
    )  # fmt: skip


_NUMBER = re.compile(r"(?<![\w.])[-−+]?\d+(\.\d+)?(e[-+]?\d+)?(?!\w)")  # not the 1 of M1


def _cut(count: int, what: str) -> str:
    return f"The first {MOST_ROWS} of {count} {what}." if count > MOST_ROWS else ""


# -- Hand-eye ---------------------------------------------------------------------------


def hand_eye_table(run: RunData) -> Table:
    """The estimated camera against the connector's design and against the truth."""
    columns = [
        Column("world", "", 0), _METHOD, Column("dx", "mm", 2), Column("dy", "mm", 2),
        Column("dz", "mm", 2), Column("turn", "deg", 3), Column("error", "mm", 3),
        Column("error", "deg", 4), Column("scatter", "mm", 3), Column("intrinsics", "px", 3),
        Column("views", "", 0),
    ]  # fmt: skip
    worlds = run.worlds
    several = len({world.case for world in worlds}) > 1
    if several:
        columns.insert(0, Column("case"))
    ranked = sorted(
        ((world, found) for world in worlds for found in world.hand_eyes),
        key=lambda pair: -pair[1].error_mm,
    )
    shown = sorted(
        ranked[:MOST_ROWS], key=lambda pair: (pair[0].case, pair[0].world, pair[1].method)
    )
    rows = []
    for world, found in shown:
        row: list[Value] = [
            world.world + 1, found.method, *found.design_mm,
            float(np.linalg.norm(found.design_deg)), found.error_mm, found.error_deg,
            found.scatter_mm, found.intrinsics_rms_px, found.views,
        ]  # fmt: skip
        rows.append([case_name(run.cases[world.case]), *row] if several else row)
    note = (
        "dx, dy, dz and turn: the estimate against the connector's design, as in the paper's "
        f"Table 3, which prints about {paper.HAND_EYE_X_MM:g} mm in x and "
        f"{paper.HAND_EYE_Z_MM:g} mm in z. error: against the truth. {_spread(worlds)}"
        f"{_cut(len(ranked), 'hand-eyes, those with the largest error')}"
    )
    return make_table("hand_eye", "The camera on the flange, world by world", columns, rows, note)


def _spread(worlds: Sequence[WorldRecord]) -> str:
    """Mean and 95th percentile of the error by method, where there are several worlds."""
    errors: dict[str, list[float]] = {}
    for world in worlds:
        for found in world.hand_eyes:
            errors.setdefault(found.method, []).append(found.error_mm)
    sentences = []
    for method, values in errors.items():
        if len(values) > 1:
            found_in = statistics(values)
            sentences.append(
                f"{method}: {found_in['mean']:.3f} mm on average over {len(values)} worlds, 95 % "
                f"below {found_in['p95']:.3f} mm. "
            )
    return "".join(sentences)


def unused_pictures(worlds: Sequence[WorldRecord]) -> list[str]:
    """Calibration pictures that were left out, with the reason."""
    return [
        f"world {world.world + 1}, {what}"
        for world in worlds
        for what in world.unused_pictures
    ][:MOST_ROWS]  # fmt: skip


# -- Worst trials -----------------------------------------------------------------------


def worst_table(run: RunData, worst: Iterable[TrialRecord]) -> Table:
    """The trials that ended worst, and what repeats each alone."""
    columns = [
        _METHOD, Column("trial", "", 0), Column("world", "", 0), Column("test", "", 0),
        Column("outcome"), Column("moved", "mm", 1), Column("turned", "deg", 1),
        Column("left", "mm", 3), Column("worst view"), Column("there", "mm", 3),
        Column("repeats it alone"),
    ]  # fmt: skip
    several = len(run.cases) > 1
    if several:
        columns.insert(1, Column("case"))
    rows = []
    for record in worst:
        view = max(record.views, key=lambda v: v.residual_mm, default=None)
        row: list[Value] = [
            record.method, record.number, record.world + 1, record.trial + 1,
            f"{record.outcome}: {record.reason}" if record.reason else record.outcome,
            record.displacement_mm, record.turn_deg, trial_values(record)["residual_mm"],
            view.id if view else "–", view.residual_mm if view else None,
            f"aoicell run scenario.toml --only {record.number} --images",
        ]  # fmt: skip
        if several:
            row.insert(1, case_name(run.cases[record.case]))
        rows.append(row)
    return make_table(
        "worst", "The trials that ended worst", columns, rows,
        f"Seed {run.scenario.seed} in scenario.toml of the run directory and the trial's number "
        "draw the same cell and the same displacement again.",
    )  # fmt: skip
