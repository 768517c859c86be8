"""The command that lets boards pass one after the other."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE
from rich.table import Table

from aoicell.benchmark.line.records import BoardRecord
from aoicell.benchmark.line.run import Recalibrate, run_line
from aoicell.benchmark.line.settings import line_settings
from aoicell.benchmark.line.store import LineStore
from aoicell.cli.app import AsJson, app, err, out
from aoicell.errors import InputError

_HEAD = "board  verdict     left mm  99.9 %   mount   light  would leave    arm s  compute s"


@app.command()
def line(
    boards: Annotated[int, typer.Option(min=1, help="How many boards pass.")] = 60,
    profile: Annotated[str | None, typer.Option(help="ideal, typical or paper.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all draws.")] = None,
    views: Annotated[Path | None, typer.Option(help="A file of inspection views.")] = None,
    defective: Annotated[
        float | None, typer.Option(help="Boards with 1 to 3 defects, per cent [20].")
    ] = None,
    mount_mm: Annotated[float | None, typer.Option(help="Drift in 100 boards [0.2].")] = None,
    mount_deg: Annotated[float | None, typer.Option(help="Drift in 100 boards [0.03].")] = None,
    light_percent: Annotated[float | None, typer.Option(help="Drift in 100 boards [5].")] = None,
    light_deg: Annotated[float | None, typer.Option(help="Drift in 100 boards [1].")] = None,
    tolerance_mm: Annotated[float | None, typer.Option(help="At the targets [0.5].")] = None,
    run_length: Annotated[
        float | None, typer.Option(help="Boards to a false warning of either chart [1000].")
    ] = None,
    golden_samples: Annotated[
        int | None, typer.Option(help="Good boards that are taught [3].")
    ] = None,
    pictures: Annotated[
        bool, typer.Option(help="Without: points are projected, nothing is inspected.")
    ] = True,
    recalibrate: Annotated[Recalibrate, typer.Option(help="When the monitor asks.")] = "ask",
    directory: Annotated[Path, typer.Option("--out", help="Folder.")] = Path("runs/line"),
    resume: Annotated[bool, typer.Option("--resume", help="Go on with what lies there.")] = False,
    as_json: AsJson = False,
) -> None:
    """Boards one after another: find, correct, inspect, decide, and watch what drifts.

    Every finished board is kept at once; --resume goes on as if nothing had been. A new line
    replaces what lies in its folder.

    Example: aoicell line --boards 40 --mount-mm 2 --mount-deg 0.3 --recalibrate auto
    """
    from aoicell.report.line import write_line  # brings Matplotlib

    settings = line_settings(
        profile=profile, seed=seed, views=_views(views), defective_percent=defective,
        mount_mm=mount_mm, mount_deg=mount_deg, light_percent=light_percent, light_deg=light_deg,
        tolerance_mm=tolerance_mm, run_length=run_length, golden_samples=golden_samples,
        pictures=pictures,
    )  # fmt: skip
    if recalibrate == "ask" and not sys.stdin.isatty():
        recalibrate = "never"
        err.print("nobody is there to be asked: the cell is not calibrated again on the way; "
                  "--recalibrate auto does", highlight=False, soft_wrap=True)  # fmt: skip
    err.print(_HEAD, style="bold", highlight=False, soft_wrap=True)
    summary = run_line(settings, directory, boards, recalibrate, _tell, _ask, resume)
    page = write_line(LineStore(directory))
    if as_json:
        print(json.dumps(summary))
    else:
        _print(summary)
    err.print(f"{page} shows it; the boards are beside it", highlight=False, soft_wrap=True)


def _views(path: Path | None) -> str | None:
    if path is None:
        return None
    if not path.is_file():
        raise InputError(f"--views {path}: there is no such file; give a file of inspection views")
    return str(path.resolve())


def _ask(record: BoardRecord) -> bool:
    hints = " ".join(f"{alarm.hint}." for alarm in record.alarms if alarm.level == "recalibrate")
    try:
        question = f"board {record.number}: {hints} Calibrate and teach again now?"
        return typer.confirm(question, default=True, err=True)
    except typer.Abort:  # Ctrl-C at the prompt is Ctrl-C
        raise KeyboardInterrupt from None


def _tell(news: BoardRecord | str) -> None:
    """One line a board, and its alarms below."""
    if isinstance(news, str):
        err.print(f"       {news}", style="dim", highlight=False)
        return
    status = news.status
    colour = {"pass": "green", "fail": "red", "no_verdict": "yellow"}[news.verdict]
    err.print(
        f"{news.number:5}  [{colour}]{news.verdict.replace('_', ' '):10}[/]"
        f"{_number(news.residual_mm, 9, 3)}{_number(news.bound_mm, 8, 3)}"
        f"{status.mount:8.2f}{status.light:8.2f}{status.left_mm:10.3f} mm"
        f"{news.arm_seconds:9.1f}{news.compute_seconds:11.1f}"
        + ("  [bold red]WRONG[/]" if news.is_wrong else ""),
        highlight=False,
        soft_wrap=True,
    )
    for alarm in news.alarms:
        style = "bold red" if alarm.level == "recalibrate" else "bold yellow"
        err.print(f"       {alarm.level}: {alarm.hint}", style=style, markup=False,
                  highlight=False, soft_wrap=True)  # fmt: skip


def _number(value: float | None, width: int, digits: int) -> str:
    return f"{'-':>{width}}" if value is None else f"{value:{width}.{digits}f}"


def _print(summary: dict[str, Any]) -> None:
    table = Table(title=f"{summary['boards']} boards", box=SIMPLE, show_header=False)
    cycle, verdicts, wrong = (summary[key] for key in ("cycle_seconds", "verdicts", "wrong"))
    rows = {
        "verdicts": ", ".join(f"{n} {v.replace('_', ' ')}" for v, n in verdicts.items()),
        "wrong": f"{wrong['escaped']} escaped, {wrong['false_alarmed']} falsely failed",
        "first wrong verdict": _board(summary["first_wrong_verdict_board"]),
        "first warning": _board(summary["first_warning_board"]),
        "first call to recalibrate": _board(summary["first_recalibrate_board"]),
        "residual": f"{_number(summary['residual_mm']['mean'], 0, 3)} mm mean",
        "cycle, arm": f"{cycle['arm']['mean']:.1f} s mean, {cycle['arm']['p95']:.1f} s p95",
        "cycle, computing": (
            f"{cycle['compute']['mean']:.1f} s mean, {cycle['compute']['p95']:.1f} s p95"
        ),
        "boards an hour": f"{summary['boards_per_hour']:.0f}",
    }
    for name, value in rows.items():
        table.add_row(name, value)
    out.print(table)


def _board(number: int | None) -> str:
    return "none" if number is None else f"board {number}"
