"""Files by pattern."""

from pathlib import Path

import pytest

from aoicell.datasets.globs import matching, starred
from aoicell.errors import InputError


def test_files_come_in_natural_order(tmp_path: Path) -> None:
    for name in ("v10", "v9", "v1", "v100"):
        (tmp_path / f"{name}.txt").touch()
    (tmp_path / "v5.txt").mkdir()  # a folder is no file
    assert [f.stem for f in matching(tmp_path, "*.txt", "it")] == ["v1", "v9", "v10", "v100"]
    assert matching(tmp_path, str(tmp_path / "v9.txt"), "it") == [tmp_path / "v9.txt"]


def test_no_file_is_an_error_that_names_the_key(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^m: 'k' = '\*.csv': no such file in"):
        matching(tmp_path, "*.csv", "m: 'k'")


def test_the_star_is_the_name() -> None:
    assert starred(Path("a/img_07_left.png"), "a/img_*_left.png", "it") == "07"
    assert starred(Path("a/7.png"), "*/*.png", "it") == "7"


@pytest.mark.parametrize("pattern", ["v*.txt.?", "v?.txt", "v.txt", "*/v.txt", "*_*.txt", "v*[ab]"])
def test_pairing_by_name_takes_one_star(pattern: str) -> None:
    with pytest.raises(InputError, match=r"exactly one '\*' in the file's name"):
        starred(Path("v1.txt"), pattern, "it")
