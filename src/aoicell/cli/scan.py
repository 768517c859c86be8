"""The command that scans an unknown board and compares what it finds with the design."""

import json
from pathlib import Path
from typing import Annotated, Any

import cv2
import typer

from aoicell.benchmark.scan_trial import HandEye, ScanTrial, run_scan, virtual_views
from aoicell.benchmark.workers import compute_on_one_thread
from aoicell.cli.app import AsJson, app, err, out
from aoicell.errors import InputError, did_you_mean
from aoicell.nominal import Nominal, load_nominal
from aoicell.observation import Image
from aoicell.planning.fusion import FusionConfig, open3d
from aoicell.planning.scan import area_about
from aoicell.planning.scanned_model import ModelConfig
from aoicell.planning.target_files import write_csv
from aoicell.report.scanned_tables import described, scan_tables
from aoicell.resources import data_root
from aoicell.sim.depth_noise import SENSORS
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import PROFILES
from aoicell.sim.rgbd import with_rgbd
from aoicell.sim.world import World

COLUMNS = (
    "designator", "x_mm", "y_mm", "rotation_deg", "side", "width_mm", "depth_mm", "height_mm",
)  # fmt: skip


@app.command()
def scan(
    folder: Annotated[Path, typer.Option("--out", help="Folder.")] = Path("scans/board"),
    profile: Annotated[str, typer.Option(help=", ".join(PROFILES) + ".")] = "typical",
    seed: Annotated[int, typer.Option(min=0, help="Of the cell, and of where the board lies.")] = 0,
    sensor: Annotated[str, typer.Option(help=", ".join(SENSORS) + ".")] = "structured_light",
    hand_eye: Annotated[
        HandEye, typer.Option(help="The depth camera's place: calibrated, or the holder's design.")
    ] = "calibrated",
    area_mm: Annotated[
        tuple[float, float], typer.Option(help="Of the table in which the board lies.")
    ] = (600.0, 520.0),
    voxel_mm: Annotated[float, typer.Option(help="Of the grid of the fusion.")] = 0.5,
    cell: Annotated[Path | None, typer.Option(help="The cell's folder [the shipped one].")] = None,
    as_json: AsJson = False,
) -> None:
    """Scan a board that is not known with a depth camera; targets and errors against the CAD.

    Writes model.ply, targets.csv, orthophoto.png, scan.png, depth.png, summary.json and
    virtual/VIEW.png. Needs Open3D: pip install 'aoicell[scan]'.

    Example: aoicell scan --out scans/board --seed 1
    """
    compute_on_one_thread()
    for option, name, known in (("profile", profile, PROFILES), ("sensor", sensor, SENSORS)):
        if name not in known:
            raise InputError(f"--{option} {name}: {did_you_mean(name, known)}")
    open3d()  # a missing library is told before the work
    design, device = load_nominal(cell or data_root() / "cell"), SENSORS[sensor]
    nominal = with_rgbd(design, device)
    area = area_about(nominal, area_mm[0] / 1e3, area_mm[1] / 1e3)
    config = ModelConfig(fusion=FusionConfig(voxel=voxel_mm / 1e3))
    world = World(nominal, draw(nominal, PROFILES[profile], seed))
    try:
        with err.status("calibrating") as status:
            trial = run_scan(world, device, area, hand_eye, config, status.update)
    finally:
        world.close()
    result = _write(trial, design, folder) | {
        "profile": profile, "seed": seed, "sensor": sensor, "hand_eye": hand_eye,
    }  # fmt: skip
    if as_json:
        print(json.dumps(result))
        return
    for table in scan_tables(trial, result):
        out.print(table)
    err.print(f"the results are in {folder}", markup=False, highlight=False, soft_wrap=True)


def _write(trial: ScanTrial, design: Nominal, folder: Path) -> dict[str, Any]:
    """Write all files; returns what summary.json says."""
    from aoicell.report.scanned import coloured_depth, scanned_figure  # these bring Matplotlib
    from aoicell.report.style import save

    model, (views, crosses) = trial.model, virtual_views(trial, design)
    result = described(trial, crosses)
    try:
        (folder / "virtual").mkdir(parents=True, exist_ok=True)
        model.write_mesh(folder / "model.ply")
        write_csv(folder / "targets.csv", model.rows(), COLUMNS)
        save(scanned_figure(model, trial.comparison), folder / "scan", vector=False)
        (folder / "summary.json").write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be written ({error.strerror})") from None
    _save(folder / "depth.png", coloured_depth(trial.first.depth))
    _save(folder / "orthophoto.png", model.photo[::-1])  # y up
    for view, image in views:
        _save(folder / "virtual" / f"{view.id}.png", image)
    return result


def _save(path: Path, rgb: Image) -> None:
    if not cv2.imwrite(str(path), rgb[:, :, ::-1]):
        raise InputError(f"--out {path}: cannot be written")
