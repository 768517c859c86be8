"""The command that compares a run with its baseline."""

import json
from pathlib import Path
from typing import Annotated

import typer

from aoicell.benchmark.baseline import read_baseline, write_baseline
from aoicell.benchmark.gate import GateResult, PracticalSizes
from aoicell.benchmark.gate import check as compare
from aoicell.benchmark.snapshot import Snapshot, snapshot
from aoicell.benchmark.store import RunStore
from aoicell.cli.app import AsJson, app, err, out
from aoicell.errors import AoicellError, InputError, Refused
from aoicell.report.gate import gate_junit, gate_markdown, gate_table, headline
from aoicell.scenario import cases_of

_DEFAULT = PracticalSizes()

OutFile = Path | None


@app.command()
def check(
    run: Annotated[Path, typer.Argument(help="A run directory.", show_default=False)],
    baseline: Annotated[Path, typer.Option(help="JSON file.", show_default=False)],
    update: Annotated[
        bool, typer.Option("--update", help="Write the run as the new baseline; compare nothing.")
    ] = False,
    practical_mm: Annotated[
        float, typer.Option(help="Changes up to this never count.")
    ] = _DEFAULT.mm,
    practical_px: Annotated[float, typer.Option(help="The same in the pictures.")] = _DEFAULT.px,
    practical_points: Annotated[
        float, typer.Option(help="The same of rates, in percentage points.")
    ] = _DEFAULT.points,
    junit: Annotated[OutFile, typer.Option(help="Write JUnit XML.")] = None,
    markdown: Annotated[
        OutFile, typer.Option(help="Append Markdown, as to $GITHUB_STEP_SUMMARY.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare a run with its baseline: exit code 1 when it has become worse.

    The same seeds are compared trial by trial, other seeds world by world.

    Example: aoicell check runs/demo --baseline scenarios/baselines/demo.json
    """
    practical = PracticalSizes(practical_mm, practical_px, practical_points)
    taken = snapshot(RunStore(run))
    if update:
        _update(baseline, taken)
        return
    result = compare(taken, read_baseline(baseline), practical)
    if junit is not None:
        _write(junit, gate_junit(result), "--junit")
    if markdown is not None:
        _write(markdown, gate_markdown(result).encode(), "--markdown", append=True)
    if as_json:
        print(json.dumps(result.as_dict()))
    else:
        out.print(gate_table(result))
    _raise_unless_passed(result)


def _update(path: Path, taken: Snapshot) -> None:
    what = "replaced" if path.exists() else "new"
    size = write_baseline(path, taken)
    scenario = taken.scenario
    trials = sum(case.scenario.trials for case in cases_of(scenario))
    err.print(
        f"{path}: {what}, {trials} trials by {' and '.join(scenario.methods)} of "
        f"'{scenario.name}', seed {scenario.seed}, {size / 1e3:.1f} kB",
        markup=False, highlight=False, soft_wrap=True,
    )  # fmt: skip


def _write(path: Path, data: bytes, option: str, append: bool = False) -> None:
    try:
        with path.open("ab" if append else "wb") as file:
            file.write(data)
    except OSError as error:
        raise InputError(f"{option} {path}: cannot be written ({error.strerror})") from None


def _raise_unless_passed(result: GateResult) -> None:
    if result.of("regressed"):
        raise AoicellError(f"worse than the baseline; {headline(result)}")
    if result.undecided:
        raise Refused(result.undecided[0])
