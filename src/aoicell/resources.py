"""Where the project's data files are, in a checkout and in an installed wheel alike."""

from pathlib import Path
from typing import Literal

from aoicell.errors import InputError

Kind = Literal["cell", "models", "scenarios"]


def data_root() -> Path:
    """Return the folder that holds `cell`, `models` and `scenarios`.

    A wheel carries them inside the package; a source checkout has them at its top.
    """
    package = Path(__file__).resolve().parent
    packed = package / "_data"
    return packed if packed.is_dir() else package.parents[1]


def find(kind: Kind, name: str) -> Path:
    """Return the path of one of the project's own files or folders.

    `name` is relative to the folder `kind`, as in `find("models", "ra620_1621")`; a scenario's
    suffix may be left out. Raises `InputError`, which lists what there is, if it is missing.
    """
    folder = data_root() / kind
    for candidate in (folder / name, folder / f"{name}.toml"):
        if name and candidate.resolve().is_relative_to(folder) and candidate.exists():
            return candidate
    there = ", ".join(available(kind)) or "nothing"
    raise InputError(f"there is no {name!r} in {folder}; it holds {there}")


def available(kind: Kind) -> list[str]:
    """Return the names that `find` takes for this kind, sorted."""
    folder = data_root() / kind
    entries = [path for path in folder.glob("*") if not path.name.startswith((".", "_"))]
    if kind == "models":
        return sorted(path.name for path in entries if path.is_dir())
    if kind == "scenarios":
        return sorted(path.stem for path in entries if path.suffix == ".toml")
    return sorted(path.name for path in entries if path.is_file())
