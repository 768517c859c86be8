import json
import sys

import pytest
from typer.testing import CliRunner

from aoicell.cli import app
from aoicell.errors import InputError
from aoicell.planning.meshes import read_mesh
from aoicell.planning.pick_and_place import read_placements


def run(*arguments):
    return CliRunner().invoke(app, ["scan", *arguments])


@pytest.mark.parametrize(
    ("option", "name", "hint"),
    [("--sensor", "structured_ligth", "structured_light"), ("--profile", "typicall", "typical")],
)
def test_an_unknown_name_is_told_with_the_nearest(option, name, hint):
    result = run(option, name)
    assert isinstance(result.exception, InputError)
    assert str(result.exception) == f"{option} {name}: did you mean '{hint}'?"


def test_without_open3d_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "open3d", None)
    result = run()
    assert isinstance(result.exception, InputError)
    assert "pip install 'aoicell[scan]'" in str(result.exception)


@pytest.mark.parametrize("arguments", [["--voxel-mm", "50"], ["--area-mm", "0", "500"]])
def test_senseless_numbers_are_named(arguments):
    pytest.importorskip("open3d", reason="Open3D is not installed: pip install 'aoicell[scan]'")
    result = run(*arguments)
    assert isinstance(result.exception, InputError)


@pytest.mark.slow
def test_a_typical_cell_finds_nine_targets_in_ten(tmp_path):
    pytest.importorskip("open3d", reason="Open3D is not installed: pip install 'aoicell[scan]'")
    result = run("--out", str(tmp_path), "--seed", "5", "--json")
    assert result.exit_code == 0, result.exception
    summary = json.loads(result.stdout)
    assert json.loads((tmp_path / "summary.json").read_text())["targets"] == summary["targets"]
    targets = summary["targets"]
    assert targets["found"] >= 0.9 * targets["designed"]
    assert targets["extra"] <= 0.03 * targets["designed"]
    assert targets["pieces"] <= 0.2 * targets["designed"]
    assert targets["position_error_mm"]["mean"] < 0.4
    assert summary["virtual_crosses_px"]["mean"] < 3
    assert read_mesh(tmp_path / "model.ply").size[0] == pytest.approx(0.42, abs=0.003)
    bumps = targets["found"] + targets["pieces"] + targets["extra"]
    assert len(read_placements(tmp_path / "targets.csv")) == bumps
    for name in ("V1", "V2", "V3", "V4"):
        assert (tmp_path / "virtual" / f"{name}.png").is_file()
