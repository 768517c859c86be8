"""The command that shows trials in a browser."""

from typing import Annotated

import typer

from aoicell.cli.app import ScenarioName, app, err, scenario_path
from aoicell.scenario import load_scenario
from aoicell.view import watch


@app.command()
def view(
    scenario: ScenarioName,
    only: Annotated[int | None, typer.Option(help="Show the trial of this number alone.")] = None,
    host: Annotated[
        str, typer.Option(help="Address to listen on; others than this let the network look on.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="[0: the first free one from 8080]")
    ] = 0,
    speed: Annotated[float, typer.Option(help="Of the arm, as a multiple of its own.")] = 1.0,
    once: Annotated[bool, typer.Option("--once", help="One trial, without waiting.")] = False,
) -> None:
    """Watch a world being calibrated, taught and put through its trials, in a browser.

    Example: aoicell view two_tests --speed 2
    """

    def say(text: str) -> None:
        err.print(text, markup=False, highlight=False, soft_wrap=True)

    watch(
        load_scenario(scenario_path(scenario)), say,
        only=only, host=host, port=port, speed=speed, once=once,
    )  # fmt: skip
