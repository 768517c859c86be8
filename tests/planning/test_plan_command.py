"""`aoicell plan`: its files, its tables, its exit codes."""

import csv
from pathlib import Path

import cv2
import pytest
import trimesh
from helpers.running import Run, run_cli
from helpers.small_boards import ROWS, write_board

from aoicell.nominal import load_views
from aoicell.resources import find


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("plan")
    board = write_board(folder / "small")
    return run_cli("plan", board, "--out", folder / "out", "--json", folder=folder / "out")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_result_for_machines(planned: Run) -> None:
    assert planned.code == 0, planned.stderr
    result = planned.summary
    assert result["coverage"] == 1.0
    assert result["area_bound"] == len(result["views"]) == 1
    assert result["targets"] == {"seen": 3, "missed": 0, "hidden": 1}
    assert {h["target"]: h["reason"] for h in result["hidden"]} == {"U1": "it lies under HS1"}
    assert result["px_per_mm"]["min"] >= 5
    assert all(Path(file).is_file() for file in result["files"])


def test_the_views_are_readable_by_a_cell(planned: Run) -> None:
    (view,) = load_views(planned.folder / "targets.toml")
    (described,) = planned.summary["views"]
    assert view.distance * 1e3 == pytest.approx(described["distance_mm"])
    assert [v * 1e3 for v in view.aim[:2]] == pytest.approx(described["aim_mm"])
    assert (planned.folder / "targets.toml").read_text().startswith("# Made by `aoicell plan ")


def test_a_line_for_each_component_and_each_feature(planned: Run) -> None:
    targets = {row["target"]: row for row in rows(planned.folder / "targets.csv")}
    assert set(targets) == {"U1", "HS1", "R1", "C1"}
    assert targets["R1"]["view"] == "P1"
    assert float(targets["R1"]["px_per_mm"]) >= 5
    assert targets["U1"]["state"] == "hidden"
    features = rows(planned.folder / "coverage.csv")
    assert {(r["target"], r["feature"]) for r in features} >= {("R1", "left cap"), ("U1", "pin 1")}


def test_a_virtual_image_for_each_view(planned: Run) -> None:
    image = cv2.imread(str(planned.folder / "virtual" / "P1.png"))
    assert image.shape == (1200, 1600, 3)
    assert image.std() > 5


def test_the_users_own_list(tmp_path: Path) -> None:
    board = write_board(tmp_path / "small")
    (tmp_path / "own.csv").write_text("designator,x_mm,y_mm,side,package\nA,40,30,top,0603\n")
    done = run_cli(
        "plan", board, "--targets", tmp_path / "own.csv", "--no-images",
        "--out", tmp_path / "out", "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    assert done.summary["targets"] == {"seen": 1, "missed": 0, "hidden": 0}


def test_views_by_hand_that_miss_something(tmp_path: Path) -> None:
    board = write_board(tmp_path / "small")
    (tmp_path / "own.toml").write_text(
        '[[view]]\nid = "H1"\naim_mm = [140, 0]\ndistance_mm = 500\ntilt_deg = [0, 0]\n'
        "roll_deg = 5\n"
    )
    done = run_cli(
        "plan", board, "--targets", tmp_path / "own.toml", "--no-images",
        "--out", tmp_path / "out", "--json",
    )  # fmt: skip
    assert done.code == 1
    assert "targets are not seen as required" in done.stderr
    assert 0 < done.summary["coverage"] < 1
    assert done.summary["missed"][0]["reason"] == "not in any picture with its margin"


def test_a_mesh(tmp_path: Path) -> None:
    trimesh.creation.box((100, 80, 20)).export(tmp_path / "part.stl")
    done = run_cli(
        "plan", tmp_path / "part.stl", "--unit", "mm", "--spacing", "20", "--no-images",
        "--out", tmp_path / "out", "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    assert done.summary["targets"]["seen"] == 20
    assert done.summary["coverage"] == 1.0


def test_wrong_inputs_are_refused(tmp_path: Path) -> None:
    trimesh.creation.box((420, 330, 20)).export(tmp_path / "part.stl")
    board = write_board(tmp_path / "small", *ROWS, "X1,chp,30,-30,0,5,5,1,,")
    for arguments, says in (
        ([tmp_path / "part.stl"], "say --unit mm"),
        ([board], "1 line is wrong\n  line 6, column kind: 'chp' is no kind"),
        (["nothing"], "nothing: no such file or folder, and no shipped board"),
        (["server_board", "--px-per-mm", "40"], "px/mm or less"),
        (["server_board", "--px-per-mm", "0"], "--px-per-mm 0: give 0.5 to 100"),
        (["server_board", "--targets", tmp_path / "no.csv"], "no such file"),
    ):
        done = run_cli("plan", *arguments, "--out", tmp_path / "out", "--json")
        assert done.code == 2
        assert done.stdout == ""
        assert says in done.stderr
        assert not (tmp_path / "out").exists()


def test_a_board_larger_than_the_reach(tmp_path: Path) -> None:
    rows = ["U1,chip,-440,-340,0,12,12,2,far,", "U2,chip,440,340,0,12,12,2,far,"]
    toml = (
        'name = "big"\nsize_mm = [900, 700, 2]\ncolour = [0, 0, 0]\ncomponents = "components.csv"\n'
    )
    board = write_board(tmp_path / "big", *rows, toml=toml)
    done = run_cli("plan", board, "--out", tmp_path / "out")
    assert done.code == 2
    assert "big, 900 x 700 mm, is larger than the arm's reach" in done.stderr


@pytest.mark.slow
def test_the_shipped_plan_is_what_the_command_makes(tmp_path: Path) -> None:
    done = run_cli("plan", "server_board", "--no-images", "--out", tmp_path)
    assert done.code == 0, done.stderr
    shipped = find("models", "server_board") / "planned.toml"
    assert (tmp_path / "targets.toml").read_text() == shipped.read_text()
