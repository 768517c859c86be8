"""Which pose belongs to which picture: by order or by name, and nothing in between."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from aoicell.datasets.globs import matching, starred
from aoicell.datasets.manifest import Manifest, PictureViews
from aoicell.datasets.poses import FilePose
from aoicell.errors import InputError


@dataclass(frozen=True)
class Match:
    """One pose and the pictures taken there, by camera; `id` is the first picture's."""

    id: str
    pose: FilePose
    pictures: Mapping[str, Path]


def find_pictures(path: Path, manifest: Manifest) -> dict[str, dict[str, Path]]:
    """Pictures by camera and id, in natural order.

    The id is what the `*` of the glob stands for, or the file's name without suffix where the
    glob is none with one `*`. Raises InputError for ids that stand twice.
    """
    assert isinstance(manifest.views, PictureViews)
    found: dict[str, dict[str, Path]] = {}
    for index, camera in enumerate(manifest.cameras):
        key = "views.images" if camera.images is None else f"camera.{index}.images"
        pattern = camera.images or manifest.views.images or ""
        named_by = f"{path}: '{key}'"
        mine: dict[str, Path] = {}
        for file in matching(path.parent, pattern, named_by):
            id = _id(file, pattern, named_by, manifest.views.pairing == "name")
            if id in mine:
                raise InputError(f"{named_by}: {mine[id]} and {file} are both picture '{id}'")
            mine[id] = file
        found[camera.name] = mine
    return found


def _id(file: Path, pattern: str, named_by: str, by_name: bool) -> str:
    one_star = Path(pattern).name.count("*") == 1 and not set("?[") & set(Path(pattern).name)
    return starred(file, pattern, named_by) if one_star or by_name else file.stem


def by_order(
    path: Path, poses: Sequence[FilePose], pictures: Mapping[str, Mapping[str, Path]]
) -> tuple[list[Match], list[str]]:
    """The first pose with the first picture, and so on; and warnings. Raises InputError."""
    for camera, mine in pictures.items():
        if len(mine) != len(poses):
            raise InputError(
                f"{path}: {len(mine)} pictures of '{camera}' and {len(poses)} poses; "
                "'views.pairing' = 'order' needs as many, or give 'name'"
            )
    columns = [list(mine.items()) for mine in pictures.values()]
    matches = [
        Match(columns[0][k][0], pose, {c: columns[i][k][1] for i, c in enumerate(pictures)})
        for k, pose in enumerate(poses)
    ]
    labels = {pose.id for pose in poses}
    crossed = [m for m in matches if m.id in labels and m.pose.id != m.id]
    if not crossed:
        return matches, []
    warning = (
        f"picture '{crossed[0].id}' is paired by order with pose '{crossed[0].pose.id}' although "
        f"there is a pose '{crossed[0].id}' ({len(crossed)} such); 'views.pairing' = 'name' "
        "pairs by name"
    )
    return matches, [warning]


def by_name(
    path: Path, poses: Sequence[FilePose], pictures: Mapping[str, Mapping[str, Path]]
) -> tuple[list[Match], list[str]]:
    """Poses and pictures of the same id, or of the picture's file name; and warnings.

    Raises InputError for a picture without a pose and for a pose that stands twice.
    """
    known: dict[str, FilePose] = {}
    for pose in poses:
        if pose.id in known:
            raise InputError(
                f"{pose.where}: pose '{pose.id}' stands twice, first in {known[pose.id].where}"
            )
        known[pose.id] = pose
    found: dict[str, dict[str, Path]] = {key: {} for key in known}
    ids: dict[str, str] = {}
    missing: list[Path] = []
    for camera, mine in pictures.items():
        for id, file in mine.items():
            key = next((k for k in (id, file.name, file.stem) if k in known), None)
            if key is None:
                missing.append(file)
            elif camera in found[key]:
                raise InputError(f"{path}: {found[key][camera]} and {file} are both view '{key}'")
            else:
                found[key][camera] = file
                ids.setdefault(key, id)
    if missing:
        some = ", ".join(str(file) for file in missing[:3])
        raise InputError(
            f"{path}: no pose for {some}{_more(len(missing) - 3)}; "
            f"the poses are called {', '.join(list(known)[:5])}{_more(len(known) - 5)}"
        )
    matches = [Match(ids[key], known[key], mine) for key, mine in found.items() if mine]
    unseen = [key for key, mine in found.items() if not mine]
    warning = f"no picture for pose {', '.join(unseen[:5])}{_more(len(unseen) - 5)}"
    return matches, [warning] if unseen else []


def _more(count: int) -> str:
    return f" and {count} more" if count > 0 else ""
