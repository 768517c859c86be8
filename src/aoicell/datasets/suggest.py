"""Which other reading of a recording's poses would be consistent? Suggests, never decides.

Every convention of the manifest is tried, also one that is missing, and A X = Z B is solved in
closed form for each: the right reading leaves the target in one place. Eye in hand with
T_base_flange fits exactly as well as eye to hand with T_flange_base, for only the product of the
two choices enters; ties are ordered by fewer changes, then by how close the part that rides on
the flange sits to it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from aoicell.calibration.hand_eye import HandEye, HandEyeConfig, Solver, solve_hand_eye
from aoicell.datasets.globs import matching
from aoicell.datasets.manifest import Manifest, PairViews, PictureViews, manifest_values
from aoicell.datasets.pairing import by_name, find_pictures
from aoicell.datasets.pose_files import read_pairs, read_poses
from aoicell.datasets.poses import FilePose, conventional, implausible_lengths, in_metres
from aoicell.datasets.readings import Variant, variants
from aoicell.datasets.recording import Recording, assemble
from aoicell.errors import Implausible, InputError
from aoicell.transforms import SE3

SOLVERS: tuple[Solver, ...] = ("shah", "li")
SHIFTS = (-3, -2, -1, 1, 2, 3)
MIN_SHIFTED = 5  # the views left over; fewer fit by chance

Pairs = Sequence[tuple[FilePose, SE3]]  # the arm's pose as in the file, T_camera_target


@dataclass(frozen=True)
class Reading:
    """One way to read the poses, and how well it fits.

    `changes` are the lines of the manifest that would have to change; none: as it stands.
    `scatter_mm` and `scatter_deg` (rms) tell how far the target strays over the views; infinite
    where `reason` says why there is no answer. `mounted_mm`: from the flange to the part on it,
    the camera (eye in hand) or the target (eye to hand).
    """

    changes: tuple[str, ...]
    views: int
    scatter_mm: float = np.inf
    scatter_deg: float = np.inf
    mounted_mm: float = np.inf
    reason: str = ""

    def __str__(self) -> str:
        what = "; ".join(self.changes) or "as the manifest stands"
        if self.reason:
            return f"no answer: {what} ({self.reason})"
        part = f"the part on the flange {self.mounted_mm:.0f} mm from it"
        return f"{self.scatter_mm:.2f} mm over {self.views} views, {part}: {what}"


def suggest(path: Path, Ts_camera_target: Mapping[str, SE3] | None = None) -> list[Reading]:
    """All readings of a recording's poses, the most consistent first.

    `Ts_camera_target` are the target's poses by view id, from the pictures; a recording of pose
    pairs brings its own. Raises InputError where no reading can be read at all.
    """
    source = _Source(path, Ts_camera_target or {})
    readings: list[Reading] = []
    problems: list[InputError] = []
    for variant in variants(path, manifest_values(path)):
        try:
            readings += source.readings(variant)
        except InputError as problem:
            problems.append(problem)
    if not readings:
        raise problems[0]
    return sorted(readings, key=_rank)


def any_reading(path: Path) -> Recording:
    """A recording whose poses mean nothing yet: its views, pictures, targets, cameras do.

    They are what is needed to find the targets first. Raises InputError.
    """
    problems: list[InputError] = []
    for variant in variants(path, manifest_values(path)):
        try:
            return assemble(path, variant.manifest, check_lengths=False)
        except InputError as problem:
            problems.append(problem)
    raise problems[0]


def _rank(reading: Reading) -> tuple[float, int, float]:
    return round(reading.scatter_mm, 6), len(reading.changes), reading.mounted_mm


# -- Poses of one variant ----------------------------------------------------------------


class _Source:
    """The recording's files, each read once, and each closed form solved once."""

    def __init__(self, path: Path, Ts_camera_target: Mapping[str, SE3]) -> None:
        self.path, self.seen = path, Ts_camera_target
        self._files: dict[tuple[str, ...], list[tuple[str, Pairs]]] = {}
        self._solved: dict[tuple[object, ...], HandEye | str] = {}

    def readings(self, variant: Variant) -> Iterator[Reading]:
        """A variant's fit, and with its poses in another order. Raises InputError."""
        views = variant.manifest.views
        key = (str(getattr(views, "pose_format", "")), str(getattr(views, "pairing", "")))
        if key not in self._files:
            self._files[key] = list(self._arrangements(variant.manifest))
        arrangements = self._files[key]
        if any("pairing" in change for change in variant.changes):
            arrangements = [entry for entry in arrangements[:1] if self._is_new(key, entry[1])]
        for note, pairs in arrangements:
            changes = (*variant.changes, note) if note else variant.changes
            yield self._reading(variant, changes, pairs, (*key, note))

    def _is_new(self, key: tuple[str, ...], pairs: Pairs) -> bool:
        """Whether this pairing joins poses and pictures otherwise than the first one did."""
        first = self._files[next(k for k in self._files if k[0] == key[0])]
        return first is self._files[key] or not first or _joined(first[0][1]) != _joined(pairs)

    def _arrangements(self, manifest: Manifest) -> Iterator[tuple[str, Pairs]]:
        """Arm poses with target poses: as the manifest pairs them, and otherwise."""
        views = manifest.views
        if isinstance(views, PairViews):
            file = matching(self.path.parent, views.pairs, f"{self.path}: 'views.pairs'")[0]
            yield "", [(arm, seen.T) for arm, seen in read_pairs(file)]
            return
        by_id = views.pairing == "name"
        named_by = f"{self.path}: 'views.poses'"
        poses = read_poses(self.path.parent, views.poses, views.pose_format, named_by, by_id)
        pictures = find_pictures(self.path, manifest)
        camera = manifest.first_target_seen_by
        if by_id:
            matches, _ = by_name(self.path, poses, {camera: pictures[camera]})
            yield "", [(m.pose, self.seen[m.id]) for m in matches if m.id in self.seen]
            return
        for note, shift, ordered in _orders(poses, len(pictures[camera])):
            numbered = enumerate(pictures[camera], shift)
            inside = [(k, id) for k, id in numbered if 0 <= k < len(poses) and id in self.seen]
            if not shift or len(inside) >= MIN_SHIFTED:
                yield note, [(ordered[k], self.seen[id]) for k, id in inside]

    def _reading(
        self, variant: Variant, changes: tuple[str, ...], pairs: Pairs, key: tuple[str, ...]
    ) -> Reading:
        """The fit of a variant; those that differ in nothing that matters share it."""
        views, mount = variant.manifest.views, variant.mount
        inverted = (mount == "eye_to_hand") != (views.pose_meaning == "T_flange_base")
        solve_key = (*key, inverted, views.length_unit)
        if solve_key not in self._solved:
            self._solved[solve_key] = _fit(views, mount, pairs)
        found = self._solved[solve_key]
        if isinstance(found, str):
            return Reading(changes, len(pairs), reason=found)
        part = found.T_flange_camera if mount == "eye_in_hand" else found.T_base_target
        mounted_mm = float(np.linalg.norm(part.translation)) * 1e3
        return Reading(changes, len(pairs), found.scatter_mm, found.scatter_deg, mounted_mm)


def _joined(pairs: Pairs) -> set[tuple[str, int]]:
    return {(pose.where, id(T)) for pose, T in pairs}


def _orders(
    poses: Sequence[FilePose], pictures: int
) -> Iterator[tuple[str, int, Sequence[FilePose]]]:
    """What may have happened to the order: a note, the shift, the poses."""
    remedy = 'give the poses ids and set [views] pairing = "name"'
    if len(poses) == pictures:
        yield "", 0, poses
        yield f"the poses stand in reverse order: {remedy}", 0, list(reversed(poses))
    else:
        yield f"{pictures} pictures but {len(poses)} poses, the last without: {remedy}", 0, poses
    for shift in SHIFTS:
        yield f"picture k belongs to pose k {shift:+d}: {remedy}", shift, poses


# -- Consistency -------------------------------------------------------------------------


def _fit(views: PictureViews | PairViews, mount: str, pairs: Pairs) -> HandEye | str:
    """The better of two closed forms, or why there is none.

    With A = T_base_flange (eye in hand) or its inverse (eye to hand), A X B = Z: X is the
    camera's pose, Z the target's.
    """
    if not pairs:
        return "no view in which the target was found"
    unit = views.length_unit
    arms = [conventional(pose.T, views.pose_meaning, unit) for pose, _ in pairs]
    targets = [T for _, T in pairs]
    odd = implausible_lengths(arms, [pose.where for pose, _ in pairs])
    if isinstance(views, PairViews):
        targets = [in_metres(T, unit) for T in targets]
        odd = odd or implausible_lengths(targets, [pose.where for pose, _ in pairs])
    if odd:
        return odd
    As = arms if mount == "eye_in_hand" else [T.inverse() for T in arms]
    found: list[HandEye] = []
    reasons: list[str] = []
    for solver in SOLVERS:
        try:
            found.append(solve_hand_eye(As, targets, HandEyeConfig(solver, max_scatter_mm=np.inf)))
        except Implausible as reason:
            reasons.append(str(reason))
        except cv2.error as error:
            reasons.append(f"OpenCV gave up ({error.err})")
    return min(found, key=lambda result: result.scatter_mm) if found else reasons[0]
