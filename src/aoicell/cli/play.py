"""The command that carries out a robot program in the simulated cell."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import cv2
import typer

from aoicell.benchmark.workers import compute_on_one_thread
from aoicell.cli.app import AsJson, app, err, out
from aoicell.errors import InputError, did_you_mean
from aoicell.nominal import load_nominal
from aoicell.observation import Observation
from aoicell.planning.exporters import EXPORTERS
from aoicell.planning.program import Program, execute
from aoicell.planning.program_file import load_program
from aoicell.resources import data_root
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import PROFILES
from aoicell.sim.world import World


@app.command()
def play(
    program: Annotated[Path, typer.Argument(help="A program file.", show_default=False)],
    profile: Annotated[str, typer.Option(help="ideal, typical or paper.")] = "typical",
    seed: Annotated[int, typer.Option(min=0, help="Seed of all draws.")] = 0,
    directory: Annotated[
        Path | None, typer.Option("--out", help="Folder of the pictures [runs/PROGRAM].")
    ] = None,
    cell: Annotated[
        Path | None, typer.Option(help="Folder of the cell [the shipped one].", show_default=False)
    ] = None,
    export: Annotated[
        str | None, typer.Option(help="Play nothing; print it as hrl or urscript.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Carry out a robot program in the simulated cell and keep its pictures as PNG files.

    Nothing but the file is known: the pictures prove it. Exit code 3 when the arm would touch
    something.

    Example: aoicell play plan/program.json --profile ideal --out pictures
    """
    if profile not in PROFILES:
        raise InputError(f"--profile {profile}: {did_you_mean(profile, PROFILES)}")
    if export is not None and export not in EXPORTERS:
        raise InputError(f"--export {export}: {did_you_mean(export, EXPORTERS)}")
    compute_on_one_thread()
    nominal = load_nominal(cell or data_root() / "cell")
    loaded = load_program(program, nominal)
    if export is not None:
        print(EXPORTERS[export][1](loaded), end="")
        return
    folder = directory or Path("runs") / program.stem
    _make(folder)
    world = World(nominal, draw(nominal, PROFILES[profile], seed))
    try:
        files = _save(execute(loaded, SimCell(world)), folder)
        took = world.clock
    finally:
        world.close()
    if as_json:
        pictures = {view: str(file) for view, file in files.items()}
        print(json.dumps(_described(loaded, profile, seed, took) | {"pictures": pictures}))
    else:
        text = f"{loaded.name}: pictures {', '.join(files)} in {took:.2f} s of the cell's time"
        out.print(text, markup=False, highlight=False, soft_wrap=True)
    err.print(f"the pictures are in {folder}", markup=False, highlight=False, soft_wrap=True)


def _described(program: Program, profile: str, seed: int, took: float) -> dict[str, object]:
    return {
        "program": program.name, "profile": profile, "seed": seed,
        "planned_s": program.duration, "took_s": took,
    }  # fmt: skip


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be made ({error.strerror})") from None


def _save(pictures: Mapping[str, Observation], folder: Path) -> dict[str, Path]:
    files = {view: folder / f"{view}.png" for view in pictures}
    for view, observation in pictures.items():
        _, data = cv2.imencode(".png", observation.image)
        try:
            files[view].write_bytes(data.tobytes())
        except OSError as error:
            raise InputError(f"--out {files[view]}: {error.strerror}") from None
    return files
