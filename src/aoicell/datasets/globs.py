"""Files by pattern, in natural order, and the part of their name that tells them apart."""

import glob
import re
from pathlib import Path

from aoicell.errors import InputError


def is_glob(pattern: str) -> bool:
    """Whether a path stands for several files."""
    return any(sign in pattern for sign in "*?[")


def matching(folder: Path, pattern: str, named_by: str) -> list[Path]:
    """The files of a glob relative to `folder`, in natural order (1, 2, 10).

    `named_by` is the key that the pattern stands under. Raises InputError when there is none.
    """
    found = [Path(folder, name) for name in glob.glob(pattern, root_dir=folder)]
    files = sorted((path for path in found if path.is_file()), key=lambda path: natural(str(path)))
    if not files:
        raise InputError(f"{named_by} = {pattern!r}: no such file in {folder.absolute()}")
    return files


def natural(text: str) -> list[str | int]:
    """A key to sort by: digits count as numbers."""
    parts = re.split(r"([0-9]+)", text)
    return [int(part) if k % 2 else part for k, part in enumerate(parts)]


def starred(path: Path, pattern: str, named_by: str) -> str:
    """What the one `*` of a glob's last part stands for. Raises InputError when it has none."""
    last = Path(pattern).name
    if last.count("*") != 1 or "?" in last or "[" in last:
        raise InputError(
            f"{named_by} = {pattern!r}: pairing by name takes exactly one '*' in the file's name "
            "and no other wildcard"
        )
    before, after = last.split("*")
    return path.name[len(before) : len(path.name) - len(after)]
