"""Commands that run scenarios."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
)

from aoicell.benchmark import export as exporting
from aoicell.benchmark import runner
from aoicell.benchmark.budget import read_budget
from aoicell.benchmark.export import Format
from aoicell.benchmark.recording import record_scenario
from aoicell.benchmark.runner import run_scenario
from aoicell.benchmark.store import RunStore
from aoicell.cli.app import AsJson, OutDir, ScenarioName, app, err, out, scenario_path
from aoicell.errors import Refused
from aoicell.nominal import load_nominal
from aoicell.report.paper import contradictions
from aoicell.report.tables import (
    cases_table,
    hand_eye_table,
    inspection_tables,
    residual_table,
    summary_table,
)
from aoicell.resources import find
from aoicell.scenario import Scenario, cases_of, load_scenario

Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes on this machine [as many as help].")
]
Scheduler = Annotated[
    str | None, typer.Option(help="A Dask cluster instead: its scheduler, tcp://HOST:8786.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with the run that lies there.")]


@app.command()
def demo(directory: OutDir = None, as_json: AsJson = False) -> None:
    """The paper's two-test experiment, small, with figures.

    Example: aoicell demo --out runs/demo
    """
    scenario = load_scenario(find("scenarios", "two_tests"))
    _run(scenario, directory or Path("runs/two_tests"), as_json)


@app.command()
def run(
    scenario: ScenarioName,
    profile: Annotated[str | None, typer.Option(help="ideal, typical or paper.")] = None,
    trials: Annotated[int | None, typer.Option(help="Trials in each world.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all draws.")] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    resume: Resume = False,
    only: Annotated[int | None, typer.Option(help="Repeat the trial of this number alone.")] = None,
    images: Annotated[bool, typer.Option("--images", help="Keep the pictures.")] = False,
    directory: OutDir = None,
    as_json: AsJson = False,
) -> None:
    """Run a scenario: displace the board, correct, visit, score.

    Every finished trial is kept at once. A new run replaces what lies in its directory.

    Example: aoicell run scenarios/two_tests.toml --profile ideal --seed 3
    """
    store = {"images": True} if images else None
    resolved = load_scenario(
        scenario_path(scenario), profile=profile, trials_per_world=trials, seed=seed, store=store
    )
    name = resolved.name if only is None else f"{resolved.name}_trial_{only}"
    _run(
        resolved, directory or Path("runs") / name, as_json,
        workers=workers, scheduler=scheduler, resume=resume, only=only,
    )  # fmt: skip


def _run(scenario: Scenario, folder: Path, as_json: bool, **how: Any) -> None:
    from aoicell.report.figures import write_figures  # these bring Matplotlib
    from aoicell.report.page import write_page

    summary = _run_trials(scenario, folder, **how)
    store = RunStore(folder)
    if not store.worlds():
        raise Refused(_first_reason(store))
    write_figures(store, scenario.fitted(load_nominal(scenario.cell_folder)))
    page, _ = write_page(store)
    if as_json:
        print(json.dumps(summary))
    else:
        _print_run(scenario, summary, store)
    err.print(f"{page} explains it; figures and all numbers are beside it", highlight=False,
              soft_wrap=True)  # fmt: skip
    if not any(method["corrected"] for method in summary["methods"].values()):
        raise Refused(f"no trial was corrected: {_first_reason(store)}")


def _first_reason(store: RunStore) -> str:
    return next((trial.reason for trial in store.trials() if trial.reason), "none was run")


def _run_trials(scenario: Scenario, folder: Path, **how: Any) -> dict[str, Any]:
    columns = (
        BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"),
    )  # fmt: skip
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task("calibrating and teaching", total=None)

        def show(progress: runner.Progress) -> None:
            bar.update(
                task, completed=progress.done, total=progress.total, description=_pace(progress)
            )

        return run_scenario(scenario, folder, show, **how)


def _pace(progress: runner.Progress) -> str:
    """Rate, remaining time and running means, once there are any."""
    left = progress.seconds_left
    if left is None:
        return "calibrating and teaching"
    means = ", ".join(f"{method} {mm:.2f} mm" for method, mm in progress.mean_mm.items())
    remaining = f"{left / 60:.0f} min" if left > 90 else f"{left:.0f} s"
    return f"{progress.trials_per_second:.2f} a second, {remaining} left; {means}"


def _print_run(scenario: Scenario, summary: dict[str, Any], store: RunStore) -> None:
    few = sum(case.scenario.trials for case in cases_of(scenario)) <= 4
    out.print(hand_eye_table(store.worlds()))
    trials = list(store.trials()) if few else []
    for method in scenario.methods if few else ():
        out.print(residual_table(trials, method))
    out.print(summary_table(summary, trials))
    if "cases" in summary:
        out.print(cases_table(summary))
    for table in inspection_tables(summary) if scenario.inspect else ():
        out.print(table)
    out.print(contradictions(), highlight=False)


@app.command()
def budget(
    scenario: ScenarioName = "error_budget",
    draws: Annotated[int | None, typer.Option(help="Cells drawn for each case.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all draws.")] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    resume: Resume = False,
    directory: OutDir = None,
    as_json: AsJson = False,
) -> None:
    """The error budget: each source alone, all but each, all together.

    Example: aoicell budget --draws 20
    """
    from aoicell.report.budget import (  # these bring Matplotlib
        budget_chart,
        budget_table,
        describe_budget,
        reproduction_chart,
    )
    from aoicell.report.style import save

    resolved = load_scenario(scenario_path(scenario), worlds=draws, seed=seed)
    folder = directory or Path("runs") / resolved.name
    store = RunStore(folder)
    _run_trials(resolved, folder, workers=workers, scheduler=scheduler, resume=resume)
    study = read_budget(store)
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
def export(
    run: Annotated[Path, typer.Argument(help="A run directory.")],
    format: Annotated[Format, typer.Option(help="csv or parquet.")] = "csv",
    directory: Annotated[Path | None, typer.Option("--out", help="Folder [RUN].")] = None,
) -> None:
    """Write trials and views as tables for other programs.

    Example: aoicell export runs/two_tests --format parquet
    """
    for path in exporting.export(RunStore(run), directory or run, format):
        err.print(f"{path}", highlight=False, soft_wrap=True)


@app.command()
def record(
    scenario: ScenarioName,
    directory: Annotated[Path, typer.Option("--out", help="A new folder.")],
    profile: Annotated[str | None, typer.Option(help="ideal, typical or paper.")] = None,
    trials: Annotated[int | None, typer.Option(help="Displacements in each world.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all draws.")] = None,
) -> None:
    """Write pictures, poses and manifests for any tool; the truth in a file apart.

    Example: aoicell record two_tests --out recordings/two_tests
    """
    resolved = load_scenario(
        scenario_path(scenario), profile=profile, trials_per_world=trials, seed=seed
    )
    with err.status("recording"):
        count = record_scenario(resolved, directory)
    err.print(
        f"{count} pictures with poses and manifests are in {directory}; what nothing that "
        "estimates may see is in its truth.json", highlight=False, soft_wrap=True,
    )  # fmt: skip
