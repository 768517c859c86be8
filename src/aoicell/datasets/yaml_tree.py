"""YAML, XML and JSON files of other tools as plain mappings, lists, numbers and texts.

OpenCV's FileStorage parses them: the YAML that calibration tools write, without anchors.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from aoicell.errors import InputError, did_you_mean
from aoicell.transforms import Array

MAX_MB = 20
_HEAD = "%YAML:1.0\n---\n"


def read_text(path: Path) -> str:
    """A text file in UTF-8. Raises InputError."""
    try:
        if path.stat().st_size > MAX_MB * 1_000_000:
            raise InputError(f"{path}: larger than {MAX_MB} MB; name a file of poses or a camera")
        return path.read_text(encoding="utf-8-sig")
    except OSError:
        raise InputError(f"{path}: no such file, or it cannot be read") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: no text file in UTF-8") from None


def read_tree(path: Path) -> dict[str, Any]:
    """The mapping at the top of a file. Raises InputError naming the file and the line."""
    text = read_text(path)
    bare = not re.match(r"\s*(%YAML|<\?xml|\{)", text)
    if bare:
        text = _HEAD + _indented(re.sub(r"\A\s*---[^\n]*\n", "\n", text))
    flags = cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY
    try:
        storage = cv2.FileStorage(text, flags)  # its nodes die with it
        tree = _value(storage.root(), path)
    except (SystemError, cv2.error) as error:  # a parsing error comes wrapped in a SystemError
        reason = _reason(str(error.__cause__ or error), _HEAD.count("\n") if bare else 0)
        raise InputError(f"{path}{reason}") from None
    if not isinstance(tree, dict):
        raise InputError(f"{path}: no 'key: value' pairs in it")
    return tree


def _reason(message: str, added: int) -> str:
    """What OpenCV says went wrong, in "... '(LINE): WHAT'", where `added` lines are ours."""
    found = re.search(r"\((\d+)\): ([^'\n]+)", message)
    if not found:
        return ": cannot be parsed as YAML, XML or JSON"
    line, what = int(found[1]) - added, found[2].strip()
    return f", line {max(1, line)}: cannot be parsed as YAML, XML or JSON ({what})"


def _indented(text: str) -> str:
    """Lists that stand as far left as their key, which YAML allows and FileStorage does not."""
    lines = []
    for line in text.splitlines():
        item = re.match(r"( *)- ", line)
        lines.append("  " + line if item else line)
    return "\n".join(lines) + "\n"


def _value(node: Any, path: Path) -> Any:
    if node.isMap():
        keys = node.keys()
        twice = next((key for key in keys if keys.count(key) > 1), None)
        if twice is not None:
            raise InputError(f"{path}: key '{twice}' stands twice; leave one")
        return {key: _value(node.getNode(key), path) for key in keys}
    if node.isSeq():
        return [_value(node.at(k), path) for k in range(node.size())]
    if node.isInt() or node.isReal():
        return node.real()
    return node.string() if node.isString() else None


def item(tree: Mapping[str, Any], path: Path, *names: str) -> Any:
    """The value under the first of several names that is there. Raises InputError."""
    for name in names:
        if name in tree:
            return tree[name]
    raise InputError(f"{path}: key '{names[0]}' is missing; {did_you_mean(names[0], tree)}")


def numbers(value: Any, path: Path, key: str, count: int | None = None) -> Array:
    """Finite numbers, flat, of a list, nested lists or `rows, cols, data`. Raises InputError."""
    if isinstance(value, dict):
        value = item(value, path, "data")
    try:
        array = np.asarray(value, dtype=float).ravel()
    except (TypeError, ValueError):
        array = np.array([np.nan])
    if not np.isfinite(array).all() or (count is not None and len(array) != count):
        wanted = "finite numbers" if count is None else f"{count} finite numbers"
        shown = repr(value) if len(repr(value)) < 80 else repr(value)[:77] + "..."
        raise InputError(f"{path}: '{key}' is {shown}; it must be {wanted}")
    return array
