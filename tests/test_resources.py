from pathlib import Path

import pytest

from aoicell import resources
from aoicell.errors import InputError

ROOT = Path(__file__).parents[1]


@pytest.fixture
def packed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed package with one model and two scenarios."""
    data = tmp_path / "aoicell" / "_data"
    (data / "models" / "arm").mkdir(parents=True)
    (data / "models" / "README.md").touch()
    (data / "cell").mkdir()
    (data / "scenarios").mkdir()
    (data / "scenarios" / "one.toml").touch()
    (data / "scenarios" / "two.toml").touch()
    monkeypatch.setattr(resources, "__file__", str(tmp_path / "aoicell" / "resources.py"))
    return data


def test_a_checkout_keeps_its_data_at_the_top() -> None:
    assert resources.data_root() == ROOT


def test_a_wheel_keeps_its_data_inside_the_package(packed: Path) -> None:
    assert resources.data_root() == packed
    assert resources.find("models", "arm") == packed / "models" / "arm"


@pytest.mark.parametrize("name", ["two", "two.toml"])
def test_a_scenario_is_found_with_and_without_its_suffix(packed: Path, name: str) -> None:
    assert resources.find("scenarios", name) == packed / "scenarios" / "two.toml"


def test_what_is_missing_is_named_beside_what_there_is(packed: Path) -> None:
    with pytest.raises(InputError, match=r"no 'three' in .*scenarios; it holds one, two$"):
        resources.find("scenarios", "three")
    with pytest.raises(InputError, match=r"no 'leg' in .*models; it holds arm$"):
        resources.find("models", "leg")
    with pytest.raises(InputError, match=r"it holds nothing$"):
        resources.find("cell", "cell.xml")


@pytest.mark.parametrize("name", ["", "../scenarios/one.toml", "/etc/hostname"])
def test_a_name_does_not_lead_out_of_its_folder(packed: Path, name: str) -> None:
    with pytest.raises(InputError):
        resources.find("models", name)
