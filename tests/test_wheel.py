"""The wheel carries its data and works far from the checkout."""

import os
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
KINDS = ("cell", "models", "scenarios")
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def run(*command: str | Path, folder: Path, **environment: str) -> str:
    """Run a command to its end in `folder` and return what it printed."""
    result = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel and the source archive."""
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "hatchling", "build", "-d", folder, folder=ROOT)
    return folder


@pytest.fixture(scope="module")
def installed(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, installed apart; its dependencies are those of this environment."""
    folder = tmp_path_factory.mktemp("installed")
    (wheel,) = built.glob("*.whl")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "install"]
    run(*pip, "--no-deps", "--no-index", "--target", folder, wheel, folder=folder)
    return folder


def aoicell(installed: Path, folder: Path, *arguments: str) -> str:
    """Run the installed command; the installed package goes before the checkout."""
    command = installed / "bin" / "aoicell"
    return run(command, *arguments, folder=folder, PYTHONPATH=str(installed))


def data_files() -> set[str]:
    """Every committed data file; a checkout without version control has no other files."""
    paths = (path for kind in KINDS for path in (ROOT / kind).rglob("*"))
    return {
        path.relative_to(ROOT).as_posix()
        for path in paths
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".pyc"
    }


def test_the_wheel_holds_every_data_file(built: Path) -> None:
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert {f"aoicell/_data/{name}" for name in data_files()} <= names
    assert {"aoicell/py.typed", "aoicell/__init__.py"} <= names
    tops = {name.split("/")[0] for name in names}
    assert tops == {"aoicell", f"aoicell-{VERSION}.dist-info"}


def test_the_source_archive_holds_what_the_wheel_is_built_from(built: Path) -> None:
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert data_files() | {"pyproject.toml", "LICENSE", "README.md", "requirements.lock"} <= names


def test_the_installed_package_has_its_version_and_its_own_data(
    installed: Path, tmp_path: Path
) -> None:
    program = "import aoicell, aoicell.resources as r; print(aoicell.__version__, r.data_root())"
    printed = run(sys.executable, "-c", program, folder=tmp_path, PYTHONPATH=str(installed))
    version, _, root = printed.strip().partition(" ")
    assert version == VERSION
    assert Path(root) == installed / "aoicell" / "_data"
    assert all(any((Path(root) / kind).iterdir()) for kind in KINDS)


def test_the_installed_command_runs_a_trial_in_an_empty_folder(
    installed: Path, tmp_path: Path
) -> None:
    aoicell(installed, tmp_path, "run", "gate", "--only", "0", "--workers", "1")
    (page,) = tmp_path.rglob("report.html")
    assert page.is_relative_to(tmp_path / "runs")


@pytest.mark.slow  # the same with pictures, the second trial, and no name to give
def test_the_installed_demo_runs_in_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    aoicell(installed, tmp_path, "demo")


def test_the_version_has_one_value() -> None:
    assert f"version: {VERSION}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## {VERSION}" in (ROOT / "CHANGELOG.md").read_text()
