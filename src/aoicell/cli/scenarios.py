"""Commands about scenario files."""

import json

import typer

from aoicell.cli.app import AsJson, ScenarioName, app, out, scenario_path
from aoicell.scenario import cases_of, load_scenario, scenario_schema

scenarios = typer.Typer(no_args_is_help=True, help="Check scenario files; print their schema.")
app.add_typer(scenarios, name="scenario")


@scenarios.command()
def check(scenario: ScenarioName, as_json: AsJson = False) -> None:
    """Read a scenario file with all its cases, and say what it would run.

    Example: aoicell scenario check scenarios/two_tests.toml
    """
    path = scenario_path(scenario)
    loaded = load_scenario(path)
    cases = cases_of(loaded)
    if as_json:
        rows = [
            {"index": c.index, "kind": c.kind, "label": c.label, "trials": c.scenario.trials}
            for c in cases
        ]
        print(json.dumps({"scenario": loaded.model_dump(), "cases": rows}))
        return
    trials = sum(case.scenario.trials for case in cases)
    out.print(
        f"{path}: correct; {trials} trials in {len(cases)} case{'s' if len(cases) > 1 else ''} "
        f"by {' and '.join(loaded.methods)}, profile {loaded.profile}, seed {loaded.seed}",
        markup=False, highlight=False, soft_wrap=True,
    )  # fmt: skip
    for case in cases if len(cases) > 1 else ():
        name = f"{case.kind} {case.label}".strip()
        out.print(f"  {case.index}: {name}, {case.scenario.trials} trials", markup=False,
                  highlight=False, soft_wrap=True)  # fmt: skip


@scenarios.command()
def schema() -> None:
    """Print the JSON schema of a scenario file, for editors that complete and check TOML.

    Example: aoicell scenario schema > scenario.schema.json
    """
    print(json.dumps(scenario_schema(), indent=2))
