"""Every complaint names the file, the key and what would be right."""

from pathlib import Path

import numpy as np
import pytest

from aoicell.errors import ModelError
from aoicell.toml_table import TomlTable
from aoicell.transforms import from_xyz_rpy

TEXT = """
name = "it"
many = [1, 2.5]
wrong = [1, "two"]
bad = nan
[deep.er]
value = 3
[poses.T]
xyz_mm = [100, 200, 300]
rpy_deg = [180, 0, 90]
[[view]]
id = "V1"
[[view]]
name = "V2"
"""


@pytest.fixture
def table(tmp_path: Path) -> TomlTable:
    (tmp_path / "a.toml").write_text(TEXT)
    return TomlTable.read(tmp_path / "a.toml")


def test_values(table: TomlTable) -> None:
    assert table.text("name") == "it"
    np.testing.assert_array_equal(table.numbers("many"), [1, 2.5])
    assert table.number("deep", "er", "value") == 3.0
    assert table.sub("deep", "er").number("value") == 3.0


def test_a_pose_is_given_in_mm_and_deg(table: TomlTable) -> None:
    expected = from_xyz_rpy([0.1, 0.2, 0.3], [np.pi, 0, np.pi / 2])
    assert table.pose("poses", "T").isApprox(expected, 1e-12)


def complaint(table: TomlTable, *keys: str, reader: str = "get", **options: int) -> str:
    with pytest.raises(ModelError) as caught:
        getattr(table, reader)(*keys, **options)
    message = str(caught.value)
    assert str(table.source) in message
    assert "\n" not in message
    return message


def test_a_missing_key_suggests_the_closest(table: TomlTable) -> None:
    assert "'nam' is missing; did you mean 'name'?" in complaint(table, "nam")


def test_a_missing_key_deep_down_is_named_by_its_whole_path(table: TomlTable) -> None:
    assert "'deep.er.vlaue'" in complaint(table, "deep", "er", "vlaue")
    assert "'deep.er.vlaue'" in complaint(table.sub("deep"), "er", "vlaue")
    assert "'name.x'" in complaint(table, "name", "x")


def test_entries_of_an_array_are_named_by_their_number(table: TomlTable) -> None:
    first, second = table.each("view")
    assert first.text("id") == "V1"
    assert "view[1]" in complaint(second, "id")


@pytest.mark.parametrize("key", ["name", "wrong", "bad", "deep"])
def test_numbers_have_to_be_finite_numbers(table: TomlTable, key: str) -> None:
    assert f"'{key}'" in complaint(table, key, reader="numbers")


def test_the_count_of_numbers_is_checked(table: TomlTable) -> None:
    assert "it must be 3 numbers" in complaint(table, "many", reader="numbers", count=3)
    assert "it must be 1 number" in complaint(table, "many", reader="number")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"absent.toml: no such file"):
        TomlTable.read(tmp_path / "absent.toml")


@pytest.mark.parametrize("content", [b"a = ", b"a = 1\na = 2", b"\xff\xfe\x00"])
def test_a_broken_file_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "broken.toml").write_bytes(content)
    with pytest.raises(ModelError, match=r"broken.toml: not valid TOML"):
        TomlTable.read(tmp_path / "broken.toml")


@pytest.mark.parametrize(
    "value",
    ["1" + "0" * 5000, "[" * 3000 + "]" * 3000, "0x" + "f" * 5000],
    ids=["too many digits", "too deep", "too long to be shown"],
)
def test_an_absurd_value_is_a_complaint_too(tmp_path: Path, value: str) -> None:
    path = tmp_path / "a.toml"
    path.write_text(f"name = {value}\n")
    with pytest.raises(ModelError) as caught:
        TomlTable.read(path).text("name")
    assert str(caught.value).startswith(f"{path}: ")
    assert len(str(caught.value).splitlines()) == 1
