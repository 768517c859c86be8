"""A recording as the calibration takes it: targets, cameras, and each view's pose and pictures."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from aoicell.camera import Camera
from aoicell.datasets.build import build_target
from aoicell.datasets.camera_files import read_camera
from aoicell.datasets.globs import matching
from aoicell.datasets.joint_files import read_arm, read_joints
from aoicell.datasets.manifest import (
    ArmEntry,
    CameraEntry,
    Manifest,
    PairViews,
    PictureViews,
    load_manifest,
)
from aoicell.datasets.pairing import Match, by_name, by_order, find_pictures
from aoicell.datasets.pictures import picture_size
from aoicell.datasets.pose_files import read_pairs, read_poses
from aoicell.datasets.poses import FilePose, conventional, implausible_lengths, in_metres
from aoicell.datasets.target_descriptions import Mount, TargetDescription
from aoicell.errors import InputError
from aoicell.robot import Arm
from aoicell.transforms import SE3, Array


@dataclass(frozen=True)
class Picture:
    """A picture of one camera; `problem` says why it cannot be used, empty when it can."""

    camera: str
    path: Path
    problem: str = ""


@dataclass(frozen=True)
class View:
    """Where the flange was, as the controller has it, and what was seen from there.

    `T_camera_target` comes with a recording of pose pairs, which has no pictures; `q` (dof,), the
    joint angles (rad), where the manifest names them.
    """

    id: str
    T_base_flange: SE3
    pictures: tuple[Picture, ...] = ()
    T_camera_target: SE3 | None = None
    q: Array | None = None

    @property
    def picture(self) -> Path | None:
        """The first camera's picture."""
        return self.pictures[0].path if self.pictures else None


@dataclass(frozen=True)
class CameraStart:
    """What is known of a camera beforehand; `size` is the pictures' width and height (px).

    `intrinsics` are to be estimated where they are None or `refine` is set. `mount`: on the flange
    (eye_in_hand) or in the base (eye_to_hand).
    """

    name: str
    size: tuple[int, int]
    mount: Mount
    intrinsics: Camera | None = None
    refine: bool = True


@dataclass(frozen=True)
class Recording:
    """A checked recording. Each target names its cameras and its mount.

    `warnings` are sentences about what looks odd and does not stop anyone.
    """

    source: Path
    mount: Mount
    targets: tuple[TargetDescription, ...]
    cameras: tuple[CameraStart, ...]
    views: tuple[View, ...]
    warnings: tuple[str, ...] = ()
    arm: Arm | None = None


def read_recording(path: Path, check_lengths: bool = True) -> Recording:
    """Read a manifest and all that it names, the pictures' contents apart.

    Raises InputError that names the file, the key and the value. A picture that is none is not
    fatal: its `problem` says so.
    """
    return assemble(path, load_manifest(path), check_lengths)


def assemble(path: Path, manifest: Manifest, check_lengths: bool = True) -> Recording:
    """The recording of a manifest that stands, or would stand, at `path`.

    Without `check_lengths` it is a reading on trial: poses are taken as they come, and an arm,
    to which they need not belong, is left aside.
    """
    if isinstance(manifest.views, PairViews):
        views = _pair_views(path, manifest.views, check_lengths)
        return Recording(path, manifest.mount, (), (), tuple(views))
    matches, warnings = match(path, manifest)
    if check_lengths:
        _check_lengths(path, manifest.views, [m.pose for m in matches])
    cameras, problems = _cameras(path, manifest, matches)
    views = [_view(m, manifest.views, problems) for m in matches]
    targets = _targets(path, manifest)
    arm = None
    if manifest.arm is not None and check_lengths:
        arm = read_arm(path.parent / manifest.arm.urdf, f"{path}: 'arm.urdf'")
        views = _with_joints(path, manifest.arm, arm, views)
    return Recording(path, manifest.mount, targets, cameras, tuple(views), tuple(warnings), arm)


def _with_joints(path: Path, entry: ArmEntry, arm: Arm, views: Sequence[View]) -> list[View]:
    """The views with their joint angles; all of them need some."""
    file = path.parent / entry.joints
    joints = read_joints(file, arm.joint_names, entry.joint_unit)
    missing = [view.id for view in views if view.id not in joints]
    if missing:
        raise InputError(
            f"{file}: no joint angles for view '{missing[0]}' ({len(missing)} of {len(views)} "
            "views have none); give one row for each"
        )
    return [replace(view, q=joints[view.id]) for view in views]


def _targets(path: Path, manifest: Manifest) -> tuple[TargetDescription, ...]:
    """The targets with camera and mount filled in; each can be built."""
    targets = []
    for index, target in enumerate(manifest.target):
        try:
            build_target(target)
        except InputError as error:
            raise InputError(f"{path}: 'target.{index}': {error}") from None
        seen_by = target.camera or [manifest.cameras[0].name]
        mount = target.mount or manifest.mount
        targets.append(target.model_copy(update={"camera": seen_by, "mount": mount}))
    return tuple(targets)


def match(path: Path, manifest: Manifest) -> tuple[list[Match], list[str]]:
    """Poses, in the file's convention, with their pictures; and warnings. Raises InputError."""
    views = manifest.views
    assert isinstance(views, PictureViews)
    named = views.pairing == "name"
    named_by = f"{path}: 'views.poses'"
    poses = read_poses(path.parent, views.poses, views.pose_format, named_by, named)
    pictures = find_pictures(path, manifest)
    return (by_name if named else by_order)(path, poses, pictures)


def _view(found: Match, views: PictureViews, problems: dict[Path, str]) -> View:
    pictures = tuple(
        Picture(camera, file, problems.get(file, "")) for camera, file in found.pictures.items()
    )
    T = conventional(found.pose.T, views.pose_meaning, views.length_unit)
    return View(found.id, T, pictures)


def _pair_views(path: Path, views: PairViews, check_lengths: bool) -> list[View]:
    file = matching(path.parent, views.pairs, f"{path}: 'views.pairs'")[0]
    pairs = read_pairs(file)
    if check_lengths:
        _check_lengths(path, views, [arm for arm, _ in pairs])
        _check_lengths(path, views, [seen for _, seen in pairs])
    result = []
    for arm, seen in pairs:
        T_base_flange = conventional(arm.T, views.pose_meaning, views.length_unit)
        T_camera_target = in_metres(seen.T, views.length_unit)
        result.append(View(arm.id, T_base_flange, T_camera_target=T_camera_target))
    return result


def _check_lengths(path: Path, views: PictureViews | PairViews, poses: Sequence[FilePose]) -> None:
    unit = views.length_unit
    odd = implausible_lengths([in_metres(p.T, unit) for p in poses], [p.where for p in poses])
    if odd:
        other = "mm" if unit == "m" else "m"
        raise InputError(f"{path}: 'views.length_unit' = '{unit}': {odd}; is the unit '{other}'?")


# -- Cameras -----------------------------------------------------------------------------


def _cameras(
    path: Path, manifest: Manifest, matches: Sequence[Match]
) -> tuple[tuple[CameraStart, ...], dict[Path, str]]:
    """The cameras, and why pictures cannot be used."""
    cameras: list[CameraStart] = []
    problems: dict[Path, str] = {}
    for entry in manifest.cameras:
        files = [m.pictures[entry.name] for m in matches if entry.name in m.pictures]
        sizes = {file: picture_size(file) for file in files}
        counts = Counter(size for size in sizes.values() if size)
        if not counts:
            raise InputError(
                f"{path}: none of the {len(files)} files for camera '{entry.name}' is a picture"
            )
        usual = counts.most_common(1)[0][0]
        for file, size in sizes.items():
            if size is None:
                problems[file] = f"{file} is no picture that can be read"
            elif size != usual:
                problems[file] = (
                    f"{file} has {size[0]}x{size[1]} px, the others {usual[0]}x{usual[1]}"
                )
        cameras.append(_start(path, entry, usual, manifest.side_of(entry)))
    return tuple(cameras), problems


def _start(path: Path, entry: CameraEntry, size: tuple[int, int], mount: Mount) -> CameraStart:
    start = CameraStart(entry.name, size, mount)
    if entry.intrinsics is None:
        return start
    file = matching(path.parent, entry.intrinsics, f"{path}: 'camera.intrinsics'")[0]
    intrinsics = read_camera(file, entry.camera_in_file, size)
    return replace(start, intrinsics=intrinsics, refine=bool(entry.refine))
