"""Commands about this machine: what works here, and how fast."""

import json
from dataclasses import asdict
from typing import Annotated, Any

import typer
from rich.box import SIMPLE
from rich.table import Table

from aoicell.benchmark.environment import describe_environment
from aoicell.benchmark.micro import BENCHMARKS
from aoicell.cli.app import AsJson, app, out
from aoicell.doctor import diagnose
from aoicell.errors import AoicellError, InputError, did_you_mean
from aoicell.nominal import load_nominal
from aoicell.resources import data_root
from aoicell.sim.profiles import PROFILES, SOURCES
from aoicell.sim.tolerances import Tolerances


@app.command()
def bench(
    name: Annotated[str, typer.Argument(help=", ".join(BENCHMARKS) + ".")],
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
    table = Table(title=f"bench {name}", box=SIMPLE)
    for column in result["rows"][0]:
        table.add_column(column, overflow="fold")  # a name that is cut could be another one's
    for row in result["rows"]:
        table.add_row(*(_shown(v) for v in row.values()))
    out.print(table)
    for ratio, value in result["ratios"].items():
        out.print(f"{ratio} = {_shown(value)}", highlight=False)


def _shown(value: Any) -> str:
    """A value of a row or a ratio; one by name for each kind or track."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {_shown(v)}" for name, v in value.items())
    return "-" if value is None else f"{value:.3f}" if isinstance(value, float) else str(value)


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
