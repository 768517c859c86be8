"""The command that plans inspection views for a board."""

import json
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import cv2
import typer
from rich.box import SIMPLE
from rich.table import Table

from aoicell.benchmark.workers import compute_on_one_thread
from aoicell.cli.app import AsJson, app, err, out
from aoicell.errors import AoicellError, InputError
from aoicell.nominal import View, load_nominal, load_views
from aoicell.planning.coverage import Inspector, Limits
from aoicell.planning.program import plan_program
from aoicell.planning.program_file import write_program
from aoicell.planning.reach import Reach
from aoicell.planning.subject import Subject, Wishes, subject_of
from aoicell.planning.table import CoverageTable, tabulate
from aoicell.planning.target_files import (
    COVERAGE_COLUMNS,
    TARGET_COLUMNS,
    coverage_rows,
    described,
    target_rows,
    view_row,
    views_text,
    write_csv,
)
from aoicell.planning.view_search import markers_in
from aoicell.planning.views import ViewPlan, area_bound, plan_views
from aoicell.planning.virtual import virtual_images
from aoicell.resources import available, data_root, find


@dataclass(frozen=True)
class _Planned:
    """All that the command shows and writes."""

    subject: Subject
    plan: ViewPlan
    table: CoverageTable
    seconds: float


@app.command()
def plan(
    board: Annotated[
        str,
        typer.Argument(help="A board's folder, a shipped board, or a mesh.", show_default=False),
    ],
    folder: Annotated[Path | None, typer.Option("--out", help="Folder [plans/BOARD].")] = None,
    targets: Annotated[
        Path | None,
        typer.Option(help="Your own: a pick-and-place CSV, or views by hand as TOML."),
    ] = None,
    unit: Annotated[
        str | None, typer.Option(help="Of a mesh [m], or of a CSV whose columns name none.")
    ] = None,
    px_per_mm: Annotated[float, typer.Option(help="Least resolution.")] = Limits().px_per_mm,
    spacing_mm: Annotated[
        float, typer.Option("--spacing", help="Of the targets on a mesh (mm).")
    ] = 10.0,
    cell: Annotated[Path | None, typer.Option(help="The cell's folder [the shipped one].")] = None,
    images: Annotated[bool, typer.Option(help="Render a virtual image of each view.")] = True,
    as_json: AsJson = False,
) -> None:
    """Plan views that show every component, and a program that takes them; exit code 1 if some
    stay unseen.

    Writes targets.toml (for a cell to teach), targets.csv, coverage.csv, coverage.png,
    program.json, joint_paths.png and virtual/VIEW.png.

    Example: aoicell plan server_board --out plans/server_board
    """
    compute_on_one_thread()
    if not 0.5 <= px_per_mm <= 100:
        raise InputError(f"--px-per-mm {px_per_mm:g}: give 0.5 to 100")
    source, by_hand = _source(board), targets is not None and targets.suffix == ".toml"
    wishes = Wishes(unit, None if by_hand else targets, spacing_mm / 1e3, Limits(px_per_mm))
    with err.status("planning views"):
        start = time.perf_counter()
        subject = subject_of(load_nominal(cell or data_root() / "cell"), source, wishes)
        given = load_views(targets) if by_hand and targets else None
        planned = _planned(subject, given, start)
    folder = folder or Path("plans") / source.stem
    files = _write(planned, folder, f"aoicell plan {board}", images)
    result = _described(planned, files)
    if as_json:
        print(json.dumps(result))
    else:
        for table in _tables(planned):
            out.print(table)
        out.print(_summary(result), highlight=False, soft_wrap=True, markup=False)
    err.print(f"{len(files)} files are in {folder}", markup=False, highlight=False, soft_wrap=True)
    missed = [row for row in planned.table.targets if row.state == "missed"]
    if missed:
        first = f"{missed[0].target} ({missed[0].reason})"
        raise AoicellError(
            f"{board}: {len(missed)} targets are not seen as required, among them {first}; "
            f"{folder / 'coverage.csv'} lists them"
        )


def _source(board: str) -> Path:
    """The path itself, or the shipped board of that name. Raises InputError."""
    path = Path(board)
    if path.exists() or board not in available("models"):
        if not path.exists():
            raise InputError(f"{board}: no such file or folder, and no shipped board of that name")
        return path
    return find("models", board)


def _planned(subject: Subject, given: tuple[View, ...] | None, start: float) -> _Planned:
    """Views of the search, or those given by hand, with what they show."""
    inspector, nominal = Inspector(subject.scene), subject.nominal
    camera, board = nominal.cameras["hand"], nominal.board
    if given is None:
        plan = plan_views(inspector, board, Reach(nominal).reaches)
    else:
        bound = area_bound(board, camera, subject.scene.limits.px_per_mm)
        markers = tuple(markers_in(board, camera, view) for view in given)
        plan = ViewPlan(given, bound, markers, (), ())
    hidden = [*subject.hidden, *plan.hidden]
    table = tabulate(inspector, plan.views, hidden, subject.kinds)
    views = described(plan.views, plan, table) if given is None else list(plan.views)
    seconds = time.perf_counter() - start
    return _Planned(subject, replace(plan, views=tuple(views)), table, seconds)


def _write(planned: _Planned, folder: Path, made_by: str, images: bool) -> list[Path]:
    """All files; a folder that cannot be written is an InputError."""
    from aoicell.report.coverage import coverage_figure  # these bring Matplotlib
    from aoicell.report.joint_paths import joint_paths
    from aoicell.report.style import save

    subject, views, table = planned.subject, planned.plan.views, planned.table
    nominal, scene = subject.nominal, subject.scene
    program = plan_program(nominal, views).program
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "targets.toml").write_text(views_text(views, made_by), encoding="utf-8")
        write_csv(folder / "targets.csv", target_rows(table), TARGET_COLUMNS)
        write_csv(folder / "coverage.csv", coverage_rows(table), COVERAGE_COLUMNS)
        write_program(program, folder / "program.json")
        names = ("targets.toml", "targets.csv", "coverage.csv", "program.json")
        files = [folder / name for name in names]
        files += save(
            coverage_figure(nominal.board, scene, views, table), folder / "coverage", vector=False
        )
        files += save(joint_paths(program, nominal.arm), folder / "joint_paths")
        if images:
            files += _write_images(subject, views, folder / "virtual")
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be written ({error.strerror})") from None
    return files


def _write_images(subject: Subject, views: tuple[View, ...], folder: Path) -> list[Path]:
    from aoicell.sim.twin import NominalTwin  # brings OpenGL, which only pictures need

    folder.mkdir(exist_ok=True)
    twin = NominalTwin(subject.nominal, subject.mesh)
    try:
        files = []
        for view, image in virtual_images(twin, views, subject.nominal.T_base_board):
            files.append(folder / f"{view.id}.png")
            cv2.imwrite(str(files[-1]), image[:, :, ::-1])
        return files
    finally:
        twin.close()


# -- What is said about it ------------------------------------------------------------------


def _described(planned: _Planned, files: list[Path]) -> dict[str, Any]:
    plan, table = planned.plan, planned.table
    states = Counter(row.state for row in table.targets)
    scales = [row.sight.px_per_mm for row in table.features if row.sight and row.state == "seen"]
    return {
        "board": planned.subject.nominal.board.name,
        "views": [
            {**view_row(view), "markers": list(markers),
             "targets": sum(row.view == view.id for row in table.targets)}
            for view, markers in zip(plan.views, plan.markers, strict=True)
        ],
        "area_bound": plan.bound,
        "coverage": table.coverage,
        "targets": {state: states[state] for state in ("seen", "missed", "hidden")},
        "px_per_mm": {"min": min(scales, default=None), "max": max(scales, default=None)},
        "hidden": [
            {"target": row.target, "feature": row.what, "reason": row.reason}
            for row in table.features if row.state == "hidden"
        ],
        "missed": [
            {"target": row.target, "feature": row.what, "reason": row.reason}
            for row in table.features if row.state == "missed"
        ],
        "seconds": round(planned.seconds, 2),
        "files": [str(path) for path in files],
    }  # fmt: skip


def _tables(planned: _Planned) -> tuple[Table, Table]:
    return _kinds_table(planned.table), _views_table(planned)


def _kinds_table(table: CoverageTable) -> Table:
    """Coverage by kind of target."""
    shown = Table(title="Coverage", box=SIMPLE)
    shown.add_column("kind")
    for column in ("targets", "seen", "missed", "hidden", "least px/mm", "least share"):
        shown.add_column(column, justify="right")
    for kind in dict.fromkeys(row.kind for row in table.targets):
        rows = [row for row in table.targets if row.kind == kind]
        states = Counter(row.state for row in rows)
        seen = [row for row in rows if row.state == "seen"]
        shown.add_row(
            kind, str(len(rows)), *(str(states[s]) for s in ("seen", "missed", "hidden")),
            f"{min(r.px_per_mm for r in seen):.2f}" if seen else "",
            f"{min(r.share for r in seen):.0%}" if seen else "",
        )  # fmt: skip
    return shown


def _views_table(planned: _Planned) -> Table:
    """The views with what each of them shows best."""
    shown = Table(title="Views", box=SIMPLE)
    shown.add_column("view")
    names = ("aim mm", "distance mm", "tilt deg", "roll deg", "targets", "px/mm", "markers")
    for column in names:
        shown.add_column(column, justify="right")
    for view, markers in zip(planned.plan.views, planned.plan.markers, strict=True):
        rows = [row for row in planned.table.features if row.view == view.id and row.sight]
        scales = [row.sight.px_per_mm for row in rows if row.sight]
        values = view_row(view)
        shown.add_row(
            view.id, "{:.0f}, {:.0f}".format(*values["aim_mm"]), f"{values['distance_mm']:.0f}",
            "{:.1f}, {:.1f}".format(*values["tilt_deg"]), f"{values['roll_deg']:.1f}",
            str(sum(row.view == view.id for row in planned.table.targets)),
            f"{min(scales):.2f} to {max(scales):.2f}" if scales else "", ", ".join(markers),
        )  # fmt: skip
    return shown


def _summary(result: dict[str, Any]) -> str:
    targets, bound = result["targets"], result["area_bound"]
    hidden = dict.fromkeys(f"{h['target']}: {h['reason']}" for h in result["hidden"])
    lines = [
        f"{len(result['views'])} views; the area bound (board area over the area of a picture at "
        f"the required resolution) is {bound}. {targets['seen']} of "
        f"{targets['seen'] + targets['missed']} targets seen ({result['coverage']:.1%}), planned "
        f"in {result['seconds']:.1f} s."
    ]
    if hidden:
        lines.append(f"Nothing can show, and does not count: {'; '.join(hidden)}.")
    return "\n".join(lines)
