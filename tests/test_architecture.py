"""The layers and the wall hold, and the contracts would notice if they did not."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WALL = "Nothing that estimates may see the truth BROKEN"


def lint_imports(folder: Path) -> subprocess.CompletedProcess[str]:
    """Check the contracts of the project in `folder`, whatever is installed."""
    return subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-logo", "--no-cache"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder / "src"), "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A copy of the source, free to be broken."""
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def append(project: Path, module: str, line: str) -> None:
    package = project / "src" / "aoicell"
    path = package / f"{module}.py"
    if not path.exists():
        path = package / module / "__init__.py"
    assert path.exists(), f"aoicell.{module} is gone: name another module here"
    with path.open("a") as file:
        file.write(f"\n{line}\n")


def test_the_contracts_hold() -> None:
    result = lint_imports(ROOT)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize("module", ["camera", "localization", "calibration", "pipeline"])
def test_an_estimator_that_imports_the_simulation_is_caught(project: Path, module: str) -> None:
    append(project, module, "import aoicell.sim")
    result = lint_imports(project)
    assert result.returncode == 1
    assert WALL in result.stdout
    assert f"aoicell.{module} -> aoicell.sim" in result.stdout


def test_so_is_one_that_hides_the_import_in_a_function(project: Path) -> None:
    append(project, "localization", "def peek():\n    from aoicell import sim\n    return sim")
    result = lint_imports(project)
    assert result.returncode == 1
    assert "aoicell.localization -> aoicell.sim" in result.stdout


def test_and_one_that_comes_by_it_through_the_package_itself(project: Path) -> None:
    append(project, "localization", "from aoicell import __version__")
    (project / "src" / "aoicell" / "__init__.py").write_text("import aoicell.sim\n")
    result = lint_imports(project)
    assert result.returncode == 1
    assert WALL in result.stdout


def test_only_the_simulation_imports_mujoco(project: Path) -> None:
    append(project, "camera", "import mujoco")
    result = lint_imports(project)
    assert result.returncode == 1
    assert "aoicell.camera -> mujoco" in result.stdout


def test_a_new_module_needs_a_place_in_the_layers(project: Path) -> None:
    (project / "src" / "aoicell" / "homeless.py").touch()
    result = lint_imports(project)
    assert result.returncode == 1
    assert "homeless" in result.stdout
