"""Writes a recording that any tool, this one included, can read: pictures, poses, manifest."""

import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import tomli_w
from PIL import Image as Pillow

from aoicell.camera import Camera
from aoicell.datasets.camera_files import write_camera
from aoicell.datasets.joint_files import write_joints
from aoicell.datasets.manifest import ArmEntry, CameraEntry, Manifest, PictureViews, PoseFormat
from aoicell.datasets.pose_writer import write_poses
from aoicell.datasets.target_descriptions import Mount, TargetDescription
from aoicell.errors import InputError
from aoicell.observation import Image
from aoicell.robot import Arm
from aoicell.transforms import SE3, Array

MANIFEST = "manifest.toml"


def write_recording(
    folder: Path,
    mount: Mount,
    targets: Sequence[TargetDescription],
    views: Iterable[tuple[str, Image, SE3]],
    camera: Camera | None = None,
    pose_format: PoseFormat = "matrix4x4_row_major",
    urdf: Path | None = None,
    joints: Mapping[str, Array] | None = None,
) -> Path:
    """Write a recording into an empty or new folder and return its manifest's path.

    `views` are (id, picture (H, W) or (H, W, 3) RGB, T_base_flange in m), taken one by one, so
    that they need not fit into memory. `camera` becomes a start that is refined. `joints` are
    joint angles (rad) by id of the arm in the file `urdf`, which is copied.
    Raises InputError for a folder that holds something, an id that is no file name or stands twice.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: not empty; name a new folder for the recording")
    (folder / "images").mkdir(parents=True)
    poses: dict[str, SE3] = {}
    for id, image, T_base_flange in views:
        if id in poses or not id or not id.replace("_", "").replace("-", "").isalnum():
            raise InputError(f"{folder}: view id {id!r} stands twice or is no plain name")
        Pillow.fromarray(image).save(folder / "images" / f"{id}.png")
        poses[id] = T_base_flange
    files = "poses.csv"
    if pose_format in ("visp_vector", "opencv_yaml"):  # these hold one pose a file
        files = "poses/*.yaml"
        (folder / "poses").mkdir()
    write_poses(folder / files, poses, pose_format)
    start = CameraEntry()
    if camera is not None:
        write_camera(camera, folder / "camera.yaml", "opencv")
        start = CameraEntry(intrinsics="camera.yaml", refine=True)
    arm = None
    if urdf is not None and joints is not None:
        shutil.copyfile(urdf, folder / "arm.urdf")
        write_joints(folder / "joints.csv", Arm(urdf).joint_names, joints)
        arm = ArmEntry(urdf="arm.urdf", joints="joints.csv", joint_unit="rad")
    manifest = Manifest(
        mount=mount,
        arm=arm,
        target=list(targets),
        views=PictureViews(
            images="images/*.png",
            poses=files,
            pose_format=pose_format,
            pose_meaning="T_base_flange",
            length_unit="m",
            pairing="name",
        ),
        camera=[start],
    )
    path = folder / MANIFEST
    path.write_text(to_toml(manifest), encoding="utf-8")
    return path


def to_toml(manifest: Manifest) -> str:
    """A manifest as a file that reads back the same."""
    return tomli_w.dumps(manifest.model_dump(exclude_none=True))
