"""The manifest of a recording: which files belong to it and how they are meant.

Nothing is guessed: a convention that is missing is a complaint that lists the choices.
"""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    field_validator,
    model_validator,
)

from aoicell.datasets.complaints import explain
from aoicell.datasets.target_descriptions import KINDS, Mount, Name, Strict, TargetDescription
from aoicell.errors import InputError, did_you_mean
from aoicell.toml_table import read_toml

PoseFormat = Literal[
    "matrix4x4_row_major",
    "xyz_quat_xyzw",
    "xyz_quat_wxyz",
    "named_quat",
    "xyz_rotvec",
    "visp_vector",
    "opencv_yaml",
]
PoseMeaning = Literal["T_base_flange", "T_flange_base"]
LengthUnit = Literal["m", "mm"]
Pairing = Literal["order", "name"]
PairFormat = Literal["json_effector_and_object"]
JointUnit = Literal["rad", "deg"]

FilePath = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=1000)]


class PictureViews(Strict):
    """Pictures and the arm's pose for each.

    `images` is a glob, taken in natural order (1, 2, 10). `poses` is one table with a row a
    view, or a glob with one file a view. `pairing = "name"`: what the `*` of the glob stands for,
    or the table's column `id`, says which belong together.
    """

    images: FilePath | None = None
    poses: FilePath
    pose_format: PoseFormat
    pose_meaning: PoseMeaning
    length_unit: LengthUnit
    pairing: Pairing


class PairViews(Strict):
    """Pose pairs without pictures: the arm's pose and the target's in the camera.

    `json_effector_and_object` is a list of [4x4, 4x4], row-major, as MoveIt Calibration saves its
    samples: the arm's pose, whose `pose_meaning` has to be said, and T_camera_target.
    """

    pairs: FilePath
    pair_format: PairFormat
    pose_meaning: PoseMeaning
    length_unit: LengthUnit


def _pictures_or_pairs(value: Any) -> str:
    pairs = "pairs" in value if isinstance(value, dict) else isinstance(value, PairViews)
    return "pose_pairs" if pairs else "pictures"


Views = Annotated[
    Annotated[PictureViews, Tag("pictures")] | Annotated[PairViews, Tag("pose_pairs")],
    Discriminator(_pictures_or_pairs),
]


class CameraEntry(Strict):
    """Where the calibration starts for one camera.

    Without `intrinsics`, or with `refine = true`, they are estimated with the hand-eye.
    `camera_in_file` picks one out of a file that holds several. Several cameras are written as
    [[camera]], each with `name` and `images` of its own. `mount` says on what this one stands:
    on the flange (eye_in_hand) or in the base (eye_to_hand).
    """

    name: Name = "camera"
    mount: Mount | None = None
    images: FilePath | None = None
    intrinsics: FilePath | None = None
    camera_in_file: str | None = None
    refine: bool | None = None

    @model_validator(mode="after")
    def _consistent(self) -> "CameraEntry":
        if self.intrinsics is None and self.refine is False:
            raise ValueError("refine = false needs 'intrinsics', a file with a calibrated camera")
        if self.intrinsics is None and self.camera_in_file is not None:
            raise ValueError("camera_in_file needs 'intrinsics', the file that it stands in")
        return self


class ArmEntry(Strict):
    """The arm's model and its joint angles, with which its own errors are estimated too.

    `joints` is a table with the column `id`, the name of the view's first picture, and one column
    for each joint of the URDF.
    """

    urdf: FilePath
    joints: FilePath
    joint_unit: JointUnit


class Manifest(Strict):
    """A recording's manifest as it stands in the file."""

    mount: Mount
    arm: ArmEntry | None = None
    target: list[TargetDescription] = Field(default=[])
    views: Views
    camera: list[CameraEntry] = Field(default=[])

    @field_validator("target", "camera", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        return [value] if isinstance(value, dict) else value

    @model_validator(mode="after")
    def _complete(self) -> "Manifest":
        if isinstance(self.views, PairViews):
            if self.target or self.camera or self.arm:
                key = "target" if self.target else "camera" if self.camera else "arm"
                raise ValueError(
                    f"'{key}' has no use beside 'views.pairs': pose pairs come without pictures"
                )
            return self
        if not self.target:
            raise ValueError("key 'target' is missing; describe what is seen in a [[target]]")
        _check_unique("target", [target.name for target in self.target if target.name])
        _check_unique("camera", [camera.name for camera in self.cameras])
        _check_pictures(self.cameras, self.views)
        _check_named_cameras(self.cameras, self.target)
        for index, camera in enumerate(self.cameras):
            if len(self.cameras) > 1 and camera.mount is None:
                self._check_side(index, camera)
        if not any(self._across(camera) for camera in self.cameras):
            raise ValueError(
                "each camera stands where all its targets stand, so that the arm moves none of "
                "them in a picture; check 'mount' of the cameras and the targets"
            )
        return self

    @property
    def cameras(self) -> list[CameraEntry]:
        """The cameras; one that is estimated from nothing where the manifest names none."""
        return self.camera or [CameraEntry()]

    def seen_by(self, camera: CameraEntry) -> list[TargetDescription]:
        """The targets that a camera sees."""
        only = len(self.cameras) == 1
        return [t for t in self.target if camera.name in (t.camera or []) or only]

    def side_of(self, camera: CameraEntry) -> Mount:
        """On what a camera stands: as it says, else as all its targets say, else the recording."""
        mounts = {target.mount or self.mount for target in self.seen_by(camera)}
        return camera.mount or (mounts.pop() if len(mounts) == 1 else self.mount)

    @property
    def first_target_seen_by(self) -> str:
        """The camera before which the arm moves the first target, or else the first it names."""
        mount = self.target[0].mount or self.mount
        mine = [c for c in self.cameras if self.target[0] in self.seen_by(c)]
        return next((c.name for c in mine if self.side_of(c) == mount), mine[0].name)

    def _across(self, camera: CameraEntry) -> bool:
        """Whether the arm moves any target before a camera."""
        return self.side_of(camera) in {t.mount or self.mount for t in self.seen_by(camera)}

    def _check_side(self, index: int, camera: CameraEntry) -> None:
        """Beside others, a camera whose targets do not tell its place has to say it."""
        mine = self.seen_by(camera)
        shared = next(
            (k for k, t in enumerate(self.target) if t in mine and len(t.camera or []) > 1), None
        )
        why = ""
        if shared is not None:
            others = [name for name in self.target[shared].camera or [] if name != camera.name]
            why = f"'target.{shared}' is seen by {', '.join(others)} too"
        elif len({t.mount or self.mount for t in mine}) > 1:
            why = "its targets differ in their mount"
        if why:
            raise ValueError(
                f"key 'camera.{index}.mount' is missing; {why}, so say on what camera "
                f"'{camera.name}' stands: 'eye_in_hand' (flange) or 'eye_to_hand' (base)"
            )


def _check_unique(key: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"'{key}.name' = {name!r} stands twice; give each {key} its own name")


def _check_pictures(cameras: list[CameraEntry], views: PictureViews) -> None:
    """Each camera has one set of pictures."""
    if len(cameras) > 1 and views.images is not None:
        raise ValueError(
            f"'views.images' = {views.images!r} cannot serve {len(cameras)} cameras; "
            "give 'images' in each [[camera]]"
        )
    for camera in cameras:
        if camera.images is None and views.images is None:
            where = "views" if len(cameras) == 1 else f"camera '{camera.name}'"
            raise ValueError(f"key 'images' of {where} is missing; give a glob as 'images/*.png'")
        if camera.images is not None and views.images is not None:
            raise ValueError(
                f"'views.images' = {views.images!r} and 'camera.images' = {camera.images!r} "
                "exclude each other; leave one"
            )


def _check_named_cameras(cameras: list[CameraEntry], targets: list[TargetDescription]) -> None:
    """Each target is seen by a camera that exists."""
    names = [camera.name for camera in cameras]
    for index, target in enumerate(targets):
        if target.camera is None and len(names) > 1:
            raise ValueError(
                f"key 'target.{index}.camera' is missing; with several cameras name one of "
                f"{', '.join(names)}"
            )
        for name in target.camera or []:
            if name not in names:
                raise ValueError(
                    f"'target.{index}.camera' = {name!r} is no camera; {did_you_mean(name, names)}"
                )
    idle = [n for n in names if len(names) > 1 and not any(n in (t.camera or []) for t in targets)]
    if idle:
        raise ValueError(
            f"no target names camera '{idle[0]}'; give it in 'camera' of a [[target]], or leave "
            "this camera out"
        )


def load_manifest(path: Path) -> Manifest:
    """Read and check a manifest. Raises InputError."""
    return check_manifest(path, manifest_values(path))


def manifest_values(path: Path) -> dict[str, Any]:
    """The file's tables, unchecked. Raises InputError."""
    return read_toml(path, "no such manifest, or it cannot be read")


def check_manifest(path: Path, values: dict[str, Any]) -> Manifest:
    """The manifest of the tables of `path`. Raises InputError naming file, key and value."""
    try:
        return Manifest.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path}: {explain(error, Manifest, _TAGS)}") from None


_TAGS: dict[str, type[BaseModel]] = {**KINDS, "pictures": PictureViews, "pose_pairs": PairViews}
