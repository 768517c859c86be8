"""The gate for anyone's own test suite: the fixture `aoicell_gate`.

    def test_the_localiser_is_as_good_as_it_was(aoicell_gate):
        aoicell_gate("scenarios/mine.toml", "scenarios/baselines/mine.json")

pytest loads this in every suite where aoicell is installed, so it imports nothing until the
fixture is called.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pytest

if TYPE_CHECKING:
    from aoicell.benchmark.gate import GateResult
    from aoicell.scenario import Scenario


class Gate(Protocol):
    """What the fixture hands out."""

    def __call__(
        self,
        scenario_or_run: str | Path | Scenario,
        baseline: str | Path,
        *,
        workers: int = 1,
        **practical: float,
    ) -> GateResult:
        """Run a scenario (a file, a shipped name, a Scenario) or take a run directory; compare.

        `practical` sets the sizes `mm`, `px` and `points` from which changes count. Fails the
        test with the table of changes; InputError and Refused are raised as they are.
        """


@pytest.fixture
def aoicell_gate(tmp_path: Path) -> Gate:
    """Compare a scenario or a finished run with a baseline; fail the test when it is worse."""

    def gate(
        scenario_or_run: str | Path | Scenario,
        baseline: str | Path,
        *,
        workers: int = 1,
        **practical: float,
    ) -> GateResult:
        from aoicell.benchmark.baseline import read_baseline
        from aoicell.benchmark.gate import PracticalSizes, check
        from aoicell.benchmark.snapshot import snapshot
        from aoicell.benchmark.store import RunStore
        from aoicell.errors import Refused
        from aoicell.report.gate import gate_table

        sizes = PracticalSizes(**practical)
        before = read_baseline(Path(baseline))
        folder = _run(scenario_or_run, tmp_path / "aoicell_run", workers)
        result = check(snapshot(RunStore(folder)), before, sizes)
        if result.of("regressed"):
            pytest.fail(_text(gate_table(result)), pytrace=False)
        if result.undecided:
            raise Refused(result.undecided[0])
        return result

    return gate


def _run(what: str | Path | Scenario, folder: Path, workers: int) -> Path:
    """The run directory that was given, or that of a new run of the scenario."""
    from aoicell.benchmark.runner import run_scenario
    from aoicell.resources import find
    from aoicell.scenario import Scenario, load_scenario

    if isinstance(what, Scenario):
        scenario = what
    elif Path(what).is_dir():
        return Path(what)
    else:
        path = Path(what)
        scenario = load_scenario(path if path.is_file() else find("scenarios", str(what)))
    run_scenario(scenario, folder, workers=workers)
    return folder


def _text(table: Any) -> str:
    from io import StringIO

    from rich.console import Console

    text = StringIO()
    Console(file=text, width=120).print(table)
    return text.getvalue()
