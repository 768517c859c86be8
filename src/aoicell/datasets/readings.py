"""The other ways to read a manifest: each convention replaced by each of its alternatives."""

import copy
import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from aoicell.datasets.manifest import (
    LengthUnit,
    Manifest,
    Pairing,
    PoseFormat,
    PoseMeaning,
    check_manifest,
)
from aoicell.datasets.target_descriptions import Mount

QUATERNIONS = ("xyz_quat_xyzw", "xyz_quat_wxyz")


@dataclass(frozen=True)
class Variant:
    """A manifest and the lines in which it differs from the file; `mount` is its target's."""

    manifest: Manifest
    changes: tuple[str, ...]
    mount: Mount


@dataclass(frozen=True)
class _Convention:
    """A key that has to be given, where it stands, and the values to try, the present one first."""

    table: str
    key: str
    given: Any
    values: tuple[str, ...]


def variants(path: Path, values: Mapping[str, Any]) -> Iterator[Variant]:
    """All combinations; the file's own comes first. Raises InputError for any other mistake."""
    conventions = _conventions(values)
    for chosen in itertools.product(*(c.values for c in conventions)):
        changed = copy.deepcopy(dict(values))
        changes = []
        for convention, value in zip(conventions, chosen, strict=True):
            _table(changed, convention.table)[convention.key] = value
            if value != convention.given:
                table = f"{convention.table} " if convention.table else ""
                changes.append(f'{table}{convention.key} = "{value}"')
        manifest = check_manifest(path, changed)
        own = manifest.target[0].mount if manifest.target else None
        yield Variant(manifest, tuple(changes), own or manifest.mount)


def _conventions(values: Mapping[str, Any]) -> list[_Convention]:
    views = values.get("views")
    if not isinstance(views, dict):
        return []  # the check names what is wrong
    targets = values.get("target")
    first = targets[0] if isinstance(targets, list) and targets else targets
    own_mount = isinstance(first, dict) and "mount" in first
    place = "[[target]]" if own_mount else ""
    mount = _Convention(place, "mount", _table(values, place).get("mount"), get_args(Mount))
    listed = [
        _Convention("[views]", key, views.get(key), get_args(kind))
        for key, kind in _keys("pairs" in views).items()
    ]
    if mount.given is None or not _cameras_say_theirs(values):
        listed.insert(0, mount)
    return [_to_try(convention) for convention in listed]


def _cameras_say_theirs(values: Mapping[str, Any]) -> bool:
    """Whether a camera says itself on what it stands: no other reading of it is tried then."""
    cameras = values.get("camera")
    listed = cameras if isinstance(cameras, list) else [cameras]
    return any(isinstance(camera, dict) and "mount" in camera for camera in listed)


def _keys(pairs: bool) -> dict[str, Any]:
    common = {"pose_meaning": PoseMeaning, "length_unit": LengthUnit}
    return common if pairs else {**common, "pose_format": PoseFormat, "pairing": Pairing}


def _to_try(c: _Convention) -> _Convention:
    """A given value comes first; a given format can only be mistaken in the quaternion's order."""
    if c.given is None:
        return c
    others = [value for value in c.values if value != c.given]
    if c.key == "pose_format":
        others = [value for value in others if {value, c.given} == set(QUATERNIONS)]
    known = c.given in c.values
    return _Convention(c.table, c.key, c.given, (c.given, *others) if known else (c.given,))


def _table(values: Mapping[str, Any], name: str) -> Any:
    if not name:
        return values
    table = values[name.strip("[]")]
    return table[0] if isinstance(table, list) else table
