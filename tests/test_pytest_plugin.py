"""The fixture in a suite of its own, as a user has it."""

import subprocess
import sys
from pathlib import Path

import pytest
from helpers.snapshots import noisy, shifted
from helpers.snapshots import stored as stored_run

from aoicell.benchmark.baseline import write_baseline
from aoicell.scenario import Scenario

pytest_plugins = ["pytester"]

SCENARIO = Scenario(
    name="ten", worlds=10, trials_per_world=5, methods=["paper", "aoicell"], pictures=False
)


@pytest.fixture
def suite(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A folder with a run and a baseline, whose aoicell_gate comes from this plugin alone."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # it may be installed, too
    run = noisy(SCENARIO)
    stored_run(run, pytester.path / "run")
    write_baseline(pytester.path / "same.json", run)
    write_baseline(pytester.path / "better.json", shifted(run, "aoicell", z_mm=-0.05))
    write_baseline(pytester.path / "other.json", noisy(Scenario(name="o", profile="ideal")))
    return pytester


def outcome(suite: pytest.Pytester, call: str) -> pytest.RunResult:
    suite.makepyfile(f"def test_it(aoicell_gate):\n    result = {call}\n    assert result.passed")
    return suite.runpytest_inprocess("-p", "aoicell.pytest_plugin", "-q")


def test_a_run_that_is_as_good_passes(suite: pytest.Pytester) -> None:
    outcome(suite, "aoicell_gate('run', 'same.json')").assert_outcomes(passed=1)


def test_a_worse_run_fails_with_the_table(suite: pytest.Pytester) -> None:
    result = outcome(suite, "aoicell_gate('run', 'better.json')")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*1 regressed*", "*z mm *+0.050*regressed*", "*the same seeds*"])
    result.stdout.no_fnmatch_line("*Traceback*")


def test_practical_sizes_are_options(suite: pytest.Pytester) -> None:
    call = "aoicell_gate('run', 'better.json', mm=0.06, px=0.2, points=2)"
    outcome(suite, call).assert_outcomes(passed=1)


def test_what_cannot_be_compared_says_why(suite: pytest.Pytester) -> None:
    result = outcome(suite, "aoicell_gate('run', 'other.json')")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*InputError: run is not of the experiment of other.json*"])
    result = outcome(suite, "aoicell_gate('no_such_scenario', 'same.json')")
    result.stdout.fnmatch_lines(["*InputError: there is no 'no_such_scenario' in*"])


@pytest.mark.slow
def test_a_scenario_is_run(suite: pytest.Pytester) -> None:
    """The same seed twice: once by the runner, once through the fixture."""
    from aoicell.benchmark.runner import run_scenario
    from aoicell.benchmark.snapshot import snapshot
    from aoicell.benchmark.store import RunStore

    small = SCENARIO.model_copy(update={"worlds": 1, "methods": ["aoicell"]})
    run_scenario(small, suite.path / "first", workers=1)
    write_baseline(suite.path / "small.json", snapshot(RunStore(suite.path / "first")))
    (suite.path / "small.toml").write_text(small.to_toml())
    outcome(suite, "aoicell_gate('small.toml', 'small.json')").assert_outcomes(passed=1)


def test_loading_the_plugin_imports_nothing_heavy() -> None:
    code = "import sys, aoicell.pytest_plugin; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert not loaded & {"mujoco", "cv2", "numpy", "scipy", "pinocchio", "rich", "pydantic"}


def test_pytest_finds_it_where_aoicell_is_installed() -> None:
    import tomllib

    text = (Path(__file__).parents[1] / "pyproject.toml").read_text()
    entries = tomllib.loads(text)["project"]["entry-points"]["pytest11"]
    assert entries == {"aoicell": "aoicell.pytest_plugin"}
