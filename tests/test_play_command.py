"""`aoicell play`: the program's file alone gives the pictures, in any process."""

import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.programs import FILES, TWO_VIEWS
from helpers.running import Run, run_cli

from aoicell.nominal import Nominal
from aoicell.planning.exporters import EXPORTERS
from aoicell.planning.program import execute
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World

PROGRAM = FILES / "two_views.json"


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A fresh process that is given the file and nothing else."""
    folder = tmp_path_factory.mktemp("played")
    command = [sys.executable, "-m", "aoicell", "play", str(PROGRAM), "--profile", "typical"]
    command += ["--seed", "3", "--out", str(folder), "--json"]
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    return Run(folder, done.stdout, done.stderr, done.returncode)


def test_a_fresh_process_takes_the_same_pictures_bit_for_bit(played: Run, nominal: Nominal) -> None:
    assert played.code == 0, played.stderr
    world = World(nominal, draw(nominal, TYPICAL, seed=3))
    pictures = execute(TWO_VIEWS, SimCell(world))
    clock = world.clock
    world.close()
    assert list(played.summary["pictures"]) == list(pictures) == ["V1", "V4"]
    for view, observation in pictures.items():
        file = Path(played.summary["pictures"][view])
        assert file == played.folder / f"{view}.png"
        kept = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(kept, observation.image)
    assert played.summary["took_s"] == clock
    assert played.summary["planned_s"] == TWO_VIEWS.duration


@pytest.mark.parametrize("language", list(EXPORTERS))
def test_an_export_goes_to_stdout(language: str) -> None:
    run = run_cli("play", PROGRAM, "--export", language)
    suffix, _ = EXPORTERS[language]
    assert (run.code, run.stdout) == (0, (FILES / f"two_views{suffix}").read_text())


def assert_one_sentence(run: Run, code: int, words: str) -> None:
    assert run.code == code, run.stderr
    assert run.stdout == ""
    (line,) = run.stderr.strip().splitlines()
    assert line.startswith("aoicell: ")
    assert words in line


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.json"], "none.json: cannot be read"),
        ([PROGRAM, "--profile", "typcal"], "--profile typcal: did you mean 'typical'?"),
        ([PROGRAM, "--export", "krl"], "--export krl: did you mean 'hrl'?"),
        ([PROGRAM, "--cell", "nowhere"], "nowhere/nominal.toml: no such file"),
        ([PROGRAM, "--out", PROGRAM], f"--out {PROGRAM}: cannot be made"),
    ],
)
def test_wrong_input_is_one_sentence(arguments: list[str | Path], words: str) -> None:
    assert_one_sentence(run_cli("play", *arguments), 2, words)


def test_a_program_that_would_touch_something_is_refused(tmp_path: Path) -> None:
    program = json.loads(PROGRAM.read_text())
    program["steps"] = [
        {"step": "move", "to": "V1", "joints_deg": [20, -60, -23, 0, -59, -68], "duration_s": 5},
        {"step": "capture", "view": "V1"},
    ]
    path = tmp_path / "low.json"
    path.write_text(json.dumps(program))
    run = run_cli("play", path, "--profile", "ideal", "--out", tmp_path / "pictures")
    assert_one_sentence(run, 3, "would touch")
    assert not list((tmp_path / "pictures").iterdir())


def test_the_help_shows_an_example() -> None:
    run = run_cli("play", "--help")
    assert "Example: aoicell play" in run.stdout
    assert "--json" in run.stdout
