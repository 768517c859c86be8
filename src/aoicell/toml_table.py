"""TOML tables that complain in one clear sentence."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.errors import InputError, ModelError, did_you_mean, shown
from aoicell.transforms import SE3, Array, from_xyz_rpy


def read_toml(path: Path, missing: str, error: type[InputError] = InputError) -> dict[str, Any]:
    """The tables of a TOML file; raises `error`, with the words `missing` where there is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError:
        raise error(f"{path}: {missing}") from None
    except (ValueError, RecursionError) as reason:  # broken, no UTF-8, endless or too deep
        raise error(f"{path}: not valid TOML ({' '.join(str(reason).split())})") from None


class TomlTable:
    """A TOML table that knows where it stands, so that a complaint can say so.

    Every reader raises ModelError with one sentence that names the file, the key and
    what would be right.
    """

    @classmethod
    def read(cls, path: Path) -> "TomlTable":
        """Read a file. Raises ModelError when it is missing or broken."""
        return cls(path, read_toml(path, "no such file; the folder must hold it", ModelError))

    def __init__(self, source: Path, values: Mapping[str, Any], where: str = "") -> None:
        self.source, self.values, self.where = source, values, where

    def get(self, *keys: str) -> Any:
        """The raw value at a key path."""
        value: Any = self.values
        for key in keys:
            if not isinstance(value, Mapping) or key not in value:
                known = value if isinstance(value, Mapping) else {}
                raise ModelError(
                    f"{self.source}: key '{self._path(*keys)}' is missing; "
                    f"{did_you_mean(key, known)}"
                )
            value = value[key]
        return value

    def sub(self, *keys: str) -> "TomlTable":
        """The table at a key path."""
        return TomlTable(self.source, self.get(*keys), self._path(*keys))

    def each(self, key: str) -> list["TomlTable"]:
        """The entries of an array of tables."""
        return [
            TomlTable(self.source, entry, f"{self._path(key)}[{index}]")
            for index, entry in enumerate(self.get(key))
        ]

    def text(self, *keys: str) -> str:
        """A text, not empty."""
        value = self.get(*keys)
        if not isinstance(value, str) or not value:
            raise self.complaint(*keys, wanted="a text")
        return value

    def numbers(self, *keys: str, count: int | None = None) -> Array:
        """Finite numbers (count,)."""
        value = self.get(*keys)
        try:
            array = np.atleast_1d(np.asarray(value, dtype=float))
        except (TypeError, ValueError):
            array = np.array([np.nan])
        if not np.isfinite(array).all() or (count is not None and array.shape != (count,)):
            wanted = "numbers" if count is None else f"{count} number{'s' * (count > 1)}"
            raise self.complaint(*keys, wanted=wanted)
        return array

    def number(self, *keys: str) -> float:
        """One finite number."""
        return float(self.numbers(*keys, count=1)[0])

    def pose(self, *keys: str) -> SE3:
        """A pose from `xyz_mm` and `rpy_deg`."""
        xyz = self.numbers(*keys, "xyz_mm", count=3) / 1e3
        return from_xyz_rpy(xyz, np.radians(self.numbers(*keys, "rpy_deg", count=3)))

    def complaint(self, *keys: str, wanted: str) -> ModelError:
        """The error to raise about the value at a key path: what it is and what was wanted."""
        value = self.get(*keys)
        place = f"{self.source}: '{self._path(*keys)}'"
        return ModelError(f"{place} is {shown(value)}; it must be {wanted}")

    def _path(self, *keys: str) -> str:
        return ".".join((self.where, *keys)).lstrip(".")
