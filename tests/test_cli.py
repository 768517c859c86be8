"""The command line: exit codes, one sentence for an error, JSON for machines."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import tomli_w
from helpers.running import Run, run_cli
from helpers.runs import workers_in_this_process

from aoicell import __version__
from aoicell.benchmark.store import RunStore
from aoicell.nominal import Nominal
from aoicell.sim.tolerances import Tolerances
from aoicell.toml_table import TomlTable

pytest_plugins = ["helpers.sessions"]

STATISTICS = (
    "displacement_mm residual_mm residual_lateral_mm residual_depth_mm residual_deg residual_px"
    " image_mm correction_seconds"
).split()
COUNTS = "trials corrected refused failed silent_wrong".split()


def assert_one_sentence(run: Run, code: int) -> None:
    """An exit code, one line on stderr, nothing on stdout."""
    assert run.code == code, run.stderr
    assert run.stdout == ""
    (line,) = run.stderr.strip().splitlines()
    assert line.startswith("aoicell: ")


# -- As a shell sees it ----------------------------------------------------------


def shell(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "aoicell", *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_a_bad_scenario_is_one_line_without_a_traceback(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text('name = "x"\nsede = 1\n')
    done = shell("run", str(path), "--out", str(tmp_path / "run"))
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == f"aoicell: {path}: unknown key 'sede'; did you mean 'seed'?\n"
    assert not (tmp_path / "run").exists()


NO_DISPLAY = {"DISPLAY": "", "WAYLAND_DISPLAY": ""}


def test_without_opengl_a_run_says_what_to_install(tmp_path: Path) -> None:
    done = shell(
        "run", "two_tests", "--profile", "ideal", "--out", str(tmp_path),
        MUJOCO_GL="disable", **NO_DISPLAY,
    )  # fmt: skip
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("aoicell: no OpenGL to render with")
    assert "apt-get install libegl1" in line


PROGRAM = """
from aoicell.errors import RenderingUnavailable
from aoicell.sim.backend import opengl_description
try:
    opengl_description()
except RenderingUnavailable as error:
    print(error)
"""


def test_glfw_without_a_display_is_no_opengl() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "MUJOCO_GL": "glfw", **NO_DISPLAY},
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    (line,) = done.stdout.strip().splitlines()
    assert line.startswith("no OpenGL to render with (glfw needs a display")
    assert "apt-get install libegl1" in line


# -- In this process ----------------------------------------------------------


@pytest.mark.parametrize("command", ["demo", "run", "doctor"])
def test_every_commands_help_shows_an_example(command: str) -> None:
    run = run_cli(command, "--help")
    assert run.code == 0
    assert f"Example: aoicell {command}" in run.stdout
    assert "--json" in run.stdout


def test_the_version() -> None:
    run = run_cli("--version")
    assert (run.code, run.stdout, run.stderr) == (0, f"{__version__}\n", "")


def test_help_names_every_command() -> None:
    run = run_cli("--help")
    assert run.code == 0
    for command in ("demo", "run", "doctor"):
        assert command in run.stdout


def test_a_list_of_shifts_has_to_match_the_trials(tmp_path: Path) -> None:
    run = run_cli(
        "run", "two_tests", "--profile", "ideal", "--trials", "5", "--out", tmp_path / "run"
    )
    assert_one_sentence(run, 2)
    assert "'displacement.shift_mm' lists 2 distances for trials_per_world = 5" in run.stderr
    assert "give one a trial, or a range" in run.stderr


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["run", "two_test"], "there is no 'two_test' in"),
        (["run", "none/of/that.toml"], "there is no 'none/of/that.toml' in"),
        (["run", "two_tests", "--profile", "idael"], "did you mean 'ideal'?"),
        (["run", "two_tests", "--seed", "-1"], "'seed' = -1"),
        (["doctor", "--profile", "papr"], "--profile papr: did you mean 'paper'?"),
    ],
)
def test_bad_arguments_are_named(arguments: list[str], expected: str) -> None:
    run = run_cli(*arguments)
    assert_one_sentence(run, 2)
    assert expected in run.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ["run"],
        ["run", "two_tests", "--trials", "many"],
        ["run", "two_tests", "--workers", "0"],
        ["fly"],
    ],
)
def test_wrong_usage_is_exit_2(arguments: list[str]) -> None:
    run = run_cli(*arguments)
    assert run.code == 2
    assert "Traceback" not in run.stderr


def test_a_file_in_the_way_of_the_run_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    run = run_cli("run", "two_tests", "--out", tmp_path / "file")
    assert_one_sentence(run, 2)


def scenario_with(folder: Path, nominal: Nominal, **changes: object) -> Path:
    """A scenario whose cell differs from the shipped one in the named tables."""
    values = dict(TomlTable.read(nominal.folder / "nominal.toml").values)
    values["models"] = {
        name: str((nominal.folder / path).resolve()) for name, path in values["models"].items()
    }
    for key, change in changes.items():
        values[key] = {**values[key], **change} if isinstance(change, dict) else change
    cell = folder / "cell"
    shutil.copytree(nominal.folder, cell)
    (cell / "nominal.toml").write_text(tomli_w.dumps(values))
    path = folder / "far.toml"
    path.write_text('name = "far"\nprofile = "ideal"\ncell = "cell"\n')
    return path


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"setup": {"T_base_flange": {"xyz_mm": [-40, 2850, 640], "rpy_deg": [180, 0, 90]}}},
            "world set-up: flange pose at (-40, 2850, 640) mm in base is out of reach",
        ),
        (
            {"poses": {"T_base_tabletarget": {"xyz_mm": [-350, 1900, 402], "rpy_deg": [0, 0, 90]}}},
            "hand-eye start: flange pose at",
        ),
    ],
)
def test_a_cell_with_a_pose_out_of_reach_is_refused(
    tmp_path: Path, nominal: Nominal, changes: dict[str, dict[str, object]], expected: str
) -> None:
    poses = dict(TomlTable.read(nominal.folder / "nominal.toml").values["poses"])
    if "poses" in changes:
        changes = {"poses": {**poses, **changes["poses"]}}
    path = scenario_with(tmp_path, nominal, **changes)
    with workers_in_this_process():
        run = run_cli("run", path, "--out", tmp_path / "run")
    assert_one_sentence(run, 3)
    assert expected in run.stderr
    assert "move it closer to the arm or choose another orientation" in run.stderr


def test_a_cell_without_its_arm_is_refused(tmp_path: Path, nominal: Nominal) -> None:
    path = scenario_with(tmp_path, nominal, models={"arm": str(tmp_path)})
    run = run_cli("run", path, "--out", tmp_path / "run")
    assert_one_sentence(run, 2)
    assert f"{tmp_path}: holds 0 URDF files" in run.stderr


def test_the_doctor_for_machines(doctor_run: Run) -> None:
    run = doctor_run
    assert run.code == 0, run.stderr
    assert run.stderr == ""
    assert set(run.summary) == {"environment", "checks"}
    assert all(set(check) == {"name", "passed", "detail"} for check in run.summary["checks"])
    assert all(check["passed"] is True for check in run.summary["checks"])
    assert len(run.summary["checks"]) == 5
    assert run.summary["environment"]["packages"]["aoicell"] == __version__


def test_a_doctor_that_finds_something_is_exit_1(monkeypatch: pytest.MonkeyPatch) -> None:
    from aoicell.cli import machine
    from aoicell.doctor import Check

    monkeypatch.setattr(machine, "diagnose", lambda _: iter([Check("one", False, "it is broken")]))
    run = run_cli("doctor")
    assert run.code == 1
    assert "FAIL one: it is broken" in run.stdout
    (line,) = run.stderr.splitlines()
    assert line == "aoicell: doctor: 'one' does not hold: it is broken"


def test_a_profile_as_a_table_and_for_machines() -> None:
    values = run_cli("doctor", "--profile", "paper", "--json").summary
    assert set(values) == set(Tolerances.model_fields)
    assert values["mount_bias_x_mm"] == 9
    table = run_cli("doctor", "--profile", "paper")
    assert table.code == 0
    assert "mount_bias_x_mm" in table.stdout


# -- The demo ----------------------------------------------------------


def test_the_demo_prints_the_summary_and_nothing_else(demo: Run) -> None:
    assert demo.code == 0, demo.stderr
    summary = demo.summary
    assert set(summary) == {
        "schema", "scenario", "seed", "profile", "methods", "arm_floor_mm", "trials_per_second",
        "render_seconds_share",
    }  # fmt: skip
    assert summary["schema"] == 1
    assert (summary["scenario"], summary["profile"]) == ("two_tests", "paper")
    assert list(summary["methods"]) == ["paper", "aoicell_one_look", "aoicell"]
    for method in summary["methods"].values():
        assert {*STATISTICS, *COUNTS, "compensation"} <= set(method)
        assert (method["trials"], method["corrected"]) == (2, 2)
        for name in STATISTICS:
            assert set(method[name]) == {"mean", "p50", "p95", "max"}
        assert 0 < method["compensation"] < 1
    assert summary["methods"]["aoicell"]["compensation"] > 0.99
    # one small marker, an uncalibrated arm: the paper's way is wrong here and does not know it
    assert [method["silent_wrong"] for method in summary["methods"].values()] == [2, 0, 0]
    assert summary["trials_per_second"] > 0
    assert 0 < summary["render_seconds_share"] < 1
    assert summary["arm_floor_mm"] > 0


def test_the_demo_leaves_a_run_directory(demo: Run) -> None:
    store = RunStore(demo.folder)
    assert store.read_json("summary.json") == demo.summary
    assert store.scenario().name == "two_tests"
    assert [(t.trial, t.method) for t in store.trials()] == [
        (trial, method) for trial in (0, 1) for method in ("aoicell", "aoicell_one_look", "paper")
    ]  # fmt: skip
    shifts = [t.displacement_mm for t in store.trials() if t.method == "paper"]
    assert shifts == [pytest.approx(49.1), pytest.approx(50.6)]
    assert {path.name for path in demo.folder.iterdir()} >= {
        "scenario.toml", "trials.sqlite", "summary.json", "environment.json", "images",
    }  # fmt: skip
    # 4 standard images, then 4 views in 2 tests by 3 methods
    assert len(list(store.images.iterdir())) == 4 + 24
    assert json.loads((demo.folder / "environment.json").read_text())["seed"] == 0
    assert str(demo.folder) in demo.stderr.replace("\n", "")


def test_the_demo_draws_its_figures(demo: Run) -> None:
    figures = list((demo.folder / "figures").iterdir())
    assert len(figures) >= 3
    assert all(figure.stat().st_size > 1000 for figure in figures)
