"""The command line.

Exit codes: 0 done, 1 a check did not hold, 2 bad input, 3 refused by a quality gate.
Results go to stdout (with --json for machines), messages to stderr.
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from aoicell import __version__
from aoicell.benchmark.budget import run_budget
from aoicell.benchmark.environment import describe_environment
from aoicell.benchmark.micro import BENCHMARKS
from aoicell.benchmark.runner import run_scenario
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.workers import local_workers
from aoicell.doctor import diagnose
from aoicell.errors import AoicellError, InputError, Refused, did_you_mean
from aoicell.nominal import load_nominal
from aoicell.report.budget import (
    budget_chart,
    budget_table,
    describe_budget,
    reproduction_chart,
)
from aoicell.report.figures import write_figures
from aoicell.report.paper import contradictions
from aoicell.report.style import save
from aoicell.report.tables import hand_eye_table, residual_table, summary_table
from aoicell.resources import data_root, find
from aoicell.scenario import Scenario, load_scenario
from aoicell.sim.profiles import PROFILES, SOURCES
from aoicell.sim.tolerances import Tolerances

app = typer.Typer(no_args_is_help=True, add_completion=True, pretty_exceptions_enable=False)
out, err = Console(), Console(stderr=True)

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]
OutDir = Annotated[Path | None, typer.Option("--out", help="Run directory [runs/SCENARIO].")]


def main() -> None:
    """Run the command line; an expected error becomes one sentence and an exit code."""
    try:
        app()
    except AoicellError as error:
        err.print(f"aoicell: {error}", markup=False, highlight=False, soft_wrap=True)
        sys.exit(error.exit_code)


def _version(show: bool) -> None:
    if show:
        out.print(__version__)
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print it.")
    ] = False,
) -> None:
    """A synthetic robot inspection cell to regress calibration and localisation against."""


@app.command()
def demo(directory: OutDir = None, as_json: AsJson = False) -> None:
    """The paper's two-test experiment, small, with figures.

    Example: aoicell demo --out runs/demo
    """
    scenario = load_scenario(find("scenarios", "two_tests"))
    _run(scenario, directory or Path("runs/two_tests"), as_json)


@app.command()
def run(
    scenario: Annotated[str, typer.Argument(help="A scenario file, or the name of a shipped one.")],
    profile: Annotated[str | None, typer.Option(help="ideal, typical or paper.")] = None,
    trials: Annotated[int | None, typer.Option(help="Trials in each world.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all draws.")] = None,
    directory: OutDir = None,
    as_json: AsJson = False,
) -> None:
    """Run a scenario: displace the board, correct, visit, score.

    Example: aoicell run scenarios/two_tests.toml --profile ideal --seed 3
    """
    path = Path(scenario)
    if not path.is_file():
        path = find("scenarios", scenario)
    resolved = load_scenario(path, profile=profile, trials_per_world=trials, seed=seed)
    _run(resolved, directory or Path("runs") / resolved.name, as_json)


def _run(scenario: Scenario, folder: Path, as_json: bool) -> None:
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task("starting", total=scenario.trials)

        def progress(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total)

        summary = run_scenario(scenario, folder, progress)
        store = RunStore(folder)
        bar.update(task, description="drawing the figures")
        figures = write_figures(store, load_nominal(scenario.cell_folder))
    if as_json:
        print(json.dumps(summary))
    else:
        _print_run(scenario, summary, store)
    err.print(f"{len(figures)} figures and all numbers are in {folder}", highlight=False)
    if not any(method["corrected"] for method in summary["methods"].values()):
        reasons = [trial.reason for trial in store.trials() if trial.reason]
        raise Refused(f"no trial was corrected: {reasons[0] if reasons else 'none was run'}")


def _print_run(scenario: Scenario, summary: dict[str, Any], store: RunStore) -> None:
    trials = store.trials()
    out.print(hand_eye_table(store.worlds()))
    if scenario.trials <= 4:
        for method in scenario.methods:
            out.print(residual_table(trials, method))
    out.print(summary_table(summary, trials))
    out.print(contradictions(), highlight=False)


@app.command()
def budget(
    scenario: Annotated[str, typer.Argument(help="A scenario file or name.")] = "error_budget",
    draws: Annotated[int | None, typer.Option(help="Cells drawn for each case.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all draws.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [one a core].")] = None,
    directory: OutDir = None,
    as_json: AsJson = False,
) -> None:
    """The error budget: each source alone, all but each, all together.

    Example: aoicell budget --draws 20
    """
    path = Path(scenario) if Path(scenario).is_file() else find("scenarios", scenario)
    resolved = load_scenario(path, worlds=draws, seed=seed)
    folder = directory or Path("runs") / resolved.name
    store = RunStore(folder)
    store.create(resolved, {**describe_environment(), "seed": resolved.seed})
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with (
        local_workers(workers) as pool,
        Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar,
    ):
        task = bar.add_task("cells", total=None)
        study = run_budget(
            resolved, pool, lambda done, total: bar.update(task, completed=done, total=total)
        )
    result = describe_budget(resolved, study)
    store.write_json("budget.json", result)
    save(budget_chart(study.table, resolved.methods), store.figures / "budget")
    save(reproduction_chart(study.table), store.figures / "reproduction")
    if as_json:
        print(json.dumps(result))
    else:
        out.print(budget_table(study, resolved.methods))
        out.print(result["conclusion"], highlight=False)
    err.print(f"table and charts are in {folder}", highlight=False)


@app.command()
def bench(
    name: Annotated[str, typer.Argument(help="optics.")],
    quick: Annotated[bool, typer.Option("--quick", help="Fewer repeats.")] = False,
    as_json: AsJson = False,
) -> None:
    """Ratios of things that are measured side by side in one run.

    Example: aoicell bench optics --quick
    """
    if name not in BENCHMARKS:
        raise InputError(f"bench {name}: {did_you_mean(name, BENCHMARKS)}")
    result = BENCHMARKS[name](quick)
    if as_json:
        print(json.dumps(result))
        return
    table = Table(*result["rows"][0], title=f"bench {name}", box=SIMPLE)
    for row in result["rows"]:
        table.add_row(*(f"{v:.3f}" if isinstance(v, float) else str(v) for v in row.values()))
    out.print(table)
    for ratio, value in result["ratios"].items():
        out.print(f"{ratio} = {value:.3f}", highlight=False)


@app.command()
def doctor(
    profile: Annotated[str | None, typer.Option(help="Print this profile as a table.")] = None,
    as_json: AsJson = False,
) -> None:
    """Rendering back end, versions and self-tests; exit code 1 when one does not hold.

    Example: aoicell doctor --profile paper
    """
    if profile is not None:
        _print_profile(profile, as_json)
        return
    environment = describe_environment()
    checks = []
    if not as_json:
        versions = ", ".join(f"{name} {number}" for name, number in environment["packages"].items())
        out.print(f"Python {environment['python']}, {versions}", highlight=False)
    for check in diagnose(load_nominal(data_root() / "cell")):
        checks.append(check)
        if not as_json:
            mark = "[green]ok  [/]" if check.passed else "[red]FAIL[/]"
            out.print(f"{mark} {check.name}: {check.detail}", highlight=False, soft_wrap=True)
    if as_json:
        result = {"environment": environment, "checks": [asdict(check) for check in checks]}
        print(json.dumps(result))
    failed = [check for check in checks if not check.passed]
    if failed:
        raise AoicellError(f"doctor: '{failed[0].name}' does not hold: {failed[0].detail}")


def _print_profile(name: str, as_json: bool) -> None:
    if name not in PROFILES:
        raise InputError(f"--profile {name}: {did_you_mean(name, PROFILES)}")
    values = PROFILES[name].model_dump()
    if as_json:
        print(json.dumps(values))
        return
    table = Table(title=f"Profile {name}", box=SIMPLE)
    table.add_column("knob", no_wrap=True)
    for column in ("value", "what, and how it is drawn", "source of the value"):
        table.add_column(column)
    for knob, field in Tolerances.model_fields.items():
        value, source = SOURCES[name].get(knob, (0.0, ""))
        extra = field.json_schema_extra
        how = str(extra["distribution"]) if isinstance(extra, dict) else ""
        shown = f"{value:g}" if value else "off"
        table.add_row(knob, shown, f"{field.description}; {how}", source)
    out.print(table)
