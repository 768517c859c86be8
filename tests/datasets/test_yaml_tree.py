"""Files of other tools as plain values."""

from pathlib import Path

import numpy as np
import pytest

from aoicell.datasets.yaml_tree import item, numbers, read_text, read_tree
from aoicell.errors import InputError


def tree(folder: Path, text: str) -> dict[str, object]:
    (folder / "f.yaml").write_text(text, encoding="utf-8")
    return read_tree(folder / "f.yaml")


@pytest.mark.parametrize(
    "text",
    [
        "a: 1.5 # note\nb: [1, 2]\nc:\n  d: word\n",
        "---\na: 1.5\nb:\n- 1\n- 2\nc: {d: word}\n",
        "\ufeffa: 1.5\r\nb:\r\n  - 1\r\n  - 2\r\nc:\r\n  d: word\r\n",
        '{"a": 1.5, "b": [1, 2], "c": {"d": "word"}}',
        '<?xml version="1.0"?><opencv_storage><a>1.5</a><b>1 2</b><c><d>word</d></c>'
        "</opencv_storage>",
    ],
)
def test_yaml_json_and_xml(tmp_path: Path, text: str) -> None:
    assert tree(tmp_path, text) == {"a": 1.5, "b": [1, 2], "c": {"d": "word"}}


def test_a_list_of_lists_as_far_left_as_its_key(tmp_path: Path) -> None:
    assert tree(tmp_path, "a:\n  b:\n  - [1, 2]\n  - [3, 4]\n  c: 5\n") == {
        "a": {"b": [[1, 2], [3, 4]], "c": 5}
    }


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a: [1, 2\n", ", line 1: cannot be parsed as YAML, XML or JSON (Missing , between"),
        ("%YAML:1.0\n---\na: 1\nb: 'x\n", ", line 4: cannot be parsed as YAML, XML or JSON ("),
        ("a: 1\na: 2\n", "key 'a' stands twice"),
        ("a:\n  b: 1\n  b: 2\n", "key 'b' stands twice"),
        ("- 1\n- 2\n", "no 'key: value' pairs"),
        ("", "no 'key: value' pairs"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(InputError) as caught:
        tree(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "f.yaml"))
    assert "\n" not in message
    assert reason in message


def test_files_that_are_no_text(tmp_path: Path) -> None:
    (tmp_path / "f").write_bytes(b"\xff\xfe\x00")
    for path, reason in [(tmp_path / "f", "no text file"), (tmp_path, "cannot be read"),
                         (tmp_path / "absent", "no such file")]:  # fmt: skip
        with pytest.raises(InputError, match=reason):
            read_text(path)


def test_numbers_are_finite_and_counted() -> None:
    path = Path("f")
    np.testing.assert_array_equal(numbers([[1, 2], [3, 4]], path, "k", 4), [1, 2, 3, 4])
    np.testing.assert_array_equal(numbers({"rows": 1, "data": [1, 2]}, path, "k"), [1, 2])
    for bad in (["a"], [1, None], [[1], [2, 3]], [np.nan], [np.inf], "word", {"rows": 1}):
        with pytest.raises(InputError, match=r"^f: "):
            numbers(bad, path, "k")
    with pytest.raises(InputError, match=r"'k' is .* must be 3 finite numbers"):
        numbers([1, 2], path, "k", 3)


def test_a_missing_key_suggests_the_closest() -> None:
    assert item({"b": 2}, Path("f"), "a", "b") == 2
    with pytest.raises(InputError, match=r"f: key 'camera' is missing; did you mean 'camra'\?"):
        item({"camra": 1}, Path("f"), "camera")
