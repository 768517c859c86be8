"""The application that every command belongs to, and what the commands share."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from aoicell import __version__
from aoicell.errors import AoicellError
from aoicell.resources import find

app = typer.Typer(no_args_is_help=True, add_completion=True, pretty_exceptions_enable=False)
out, err = Console(), Console(stderr=True)

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]
OutDir = Annotated[Path | None, typer.Option("--out", help="Run directory [runs/SCENARIO].")]
ScenarioName = Annotated[str, typer.Argument(help="A scenario file, or the name of a shipped one.")]


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


def scenario_path(scenario: str) -> Path:
    """The file itself, or the shipped scenario of that name. Raises InputError."""
    path = Path(scenario)
    return path if path.is_file() else find("scenarios", scenario)
