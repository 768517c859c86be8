"""The command that calibrates a recording of any robot."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from aoicell.benchmark.workers import compute_on_one_thread
from aoicell.cli.app import AsJson, app, err, out
from aoicell.datasets.describe import describe, hand_eye_result
from aoicell.datasets.drift import check_recording, describe_check, lines_of, raise_unless_ok
from aoicell.datasets.other_readings import suggest_readings
from aoicell.datasets.recording import read_recording
from aoicell.datasets.result_files import with_reference
from aoicell.datasets.results import FrameNames, to_easy_handeye2, to_moveit_launch
from aoicell.datasets.solve import Solved, solve_recording
from aoicell.datasets.suggest import Reading
from aoicell.errors import InputError, Refused
from aoicell.report.calibration_tables import calibration_tables, readings_table

Format = Literal["json", "easy_handeye2", "moveit"]
_DEFAULT = FrameNames("base_link", "tool0", "camera_optical_frame")

_MOST_WARNINGS = 5  # on stderr


@app.command()
def calibrate(
    manifest: Annotated[Path, typer.Argument(help="Its manifest.toml.", show_default=False)],
    file: Annotated[
        Path | None, typer.Option("--out", help="Write the result.", show_default=False)
    ] = None,
    format: Annotated[
        Format, typer.Option(help="Of --out: json, easy_handeye2 or moveit.")
    ] = "json",
    suggest: Annotated[
        bool, typer.Option("--suggest", help="Rank other readings of the poses; change nothing.")
    ] = False,
    report: Annotated[
        Path | None, typer.Option(help="Folder for overlays of each view.", show_default=False)
    ] = None,
    check: Annotated[
        Path | None,
        typer.Option(
            help="Is this result still good? Exit 1: drifted, 3: cannot tell.", show_default=False
        ),
    ] = None,
    fixed: Annotated[
        bool, typer.Option("--fixed", help="With --check: the target has not been moved.")
    ] = False,
    base_frame: Annotated[str, typer.Option(help="Name in tf.")] = _DEFAULT.base,
    flange_frame: Annotated[str, typer.Option(help="Name in tf.")] = _DEFAULT.flange,
    camera_frame: Annotated[str, typer.Option(help="Its optical frame.")] = _DEFAULT.camera,
    as_json: AsJson = False,
) -> None:
    """Calibrate camera and hand-eye from recorded pictures and poses; exit code 3 when refused.

    Example: aoicell calibrate recording/manifest.toml --out hand_eye.json
    """
    compute_on_one_thread()  # sums are then formed in the same order everywhere
    if suggest:
        _suggest(manifest, as_json)
        return
    if check is not None:
        _check(manifest, check, fixed, as_json)
        return
    with err.status("finding the target and calibrating"):
        solved = solve_recording(read_recording(manifest))
    result = with_reference(describe(solved), solved)
    if as_json:
        print(json.dumps(result, allow_nan=False))
    else:
        for table in calibration_tables(result):
            out.print(table)
    for warning in result["warnings"][:_MOST_WARNINGS]:
        _say(f"warning: {warning}")
    if len(result["warnings"]) > _MOST_WARNINGS:
        _say(f"warning: {len(result['warnings']) - _MOST_WARNINGS} more, all of them in --json")
    if report is not None:
        from aoicell.report.calibration import write_overlays  # brings Matplotlib

        count = len(write_overlays(solved, report))
        _say(f"{count} figures are in {report}")
    frames = FrameNames(base_frame, flange_frame, camera_frame)
    if file is not None and (format == "json" or solved.report.verdict != "refused"):
        _write(file, _as_text(solved, result, format, frames))
        _say(f"the result is in {file}")
    if solved.report.verdict == "refused":
        if solved.report.solution is not None:
            _say("other readings of the poses are ranked with --suggest")
        raise Refused(f"{manifest}: calibration refused: {'; '.join(result['reasons'])}")
    for reason in result["reasons"]:
        _say(f"suspect: {reason}")


def _as_text(solved: Solved, result: dict[str, Any], format: Format, frames: FrameNames) -> str:
    if format == "json":
        return json.dumps(result, indent=2, allow_nan=False) + "\n"
    if "cameras" in result:
        raise InputError(
            f"--format {format} holds one camera, the recording has {len(result['cameras'])}; "
            "use --format json"
        )
    found = hand_eye_result(solved)
    if format == "moveit":
        return to_moveit_launch(found, frames)
    return to_easy_handeye2(found, frames, solved.recording.source.parent.name or "hand_eye")


def _suggest(manifest: Path, as_json: bool) -> None:
    with err.status("trying other readings"):
        readings = suggest_readings(manifest)
    if as_json:
        print(json.dumps({"readings": [_described(r) for r in readings]}, allow_nan=False))
    else:
        out.print(readings_table(readings))
        out.print(
            "Nothing was changed: the recording's maker knows which reading is true.",
            highlight=False,
        )


def _check(manifest: Path, result: Path, fixed: bool, as_json: bool) -> None:
    with err.status("finding the target and comparing"):
        checked = check_recording(manifest, result, fixed)
    if as_json:
        print(json.dumps(describe_check(checked), allow_nan=False))
    else:
        for line in lines_of(checked):
            out.print(line, markup=False, highlight=False, soft_wrap=True)
    for warning in checked.warnings:
        _say(f"warning: {warning}")
    raise_unless_ok(checked, manifest)


def _described(reading: Reading) -> dict[str, Any]:
    numbers = {
        name: round(value, 6) if abs(value) < float("inf") else None
        for name, value in (
            ("scatter_mm", reading.scatter_mm),
            ("scatter_deg", reading.scatter_deg),
            ("mounted_mm", reading.mounted_mm),
        )
    }
    changes = list(reading.changes)
    return {"changes": changes, "views": reading.views, **numbers, "reason": reading.reason}


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"--out {path}: cannot be written ({error.strerror})") from None


def _say(text: str) -> None:
    err.print(text, markup=False, highlight=False, soft_wrap=True)
