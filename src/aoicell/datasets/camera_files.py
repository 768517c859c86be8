"""Files with a camera's intrinsics: ROS camera_info, OpenCV storage, Kalibr camchain; in and out.

All three put pixel (0, 0) at the centre of the top left pixel, as `Camera` does. The forms are told
apart by their keys; also read: the `intrinsics` block of ROS-Industrial's industrial_calibration.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.datasets.yaml_tree import item, numbers, read_tree
from aoicell.errors import InputError, did_you_mean
from aoicell.transforms import Array

CameraForm = Literal["ros", "opencv", "kalibr"]

_K_NAMES = ("camera_matrix", "Camera_Matrix", "cameraMatrix", "K")
_D_NAMES = ("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "D")
_WIDTHS, _HEIGHTS = ("image_width", "image_Width"), ("image_height", "image_Height")
_COUNTS = (0, 4, 5, 8, 12, 14)  # OpenCV's model of lenses, cut off after so many coefficients
_PINHOLE = {"plumb_bob", "rational_polynomial", "none", ""}


def read_camera(path: Path, name: str | None = None, size: tuple[int, int] | None = None) -> Camera:
    """The camera in a file.

    `name` picks one out of a camchain. `size` is the width and height of the pictures: taken where
    the file has none, else compared. Raises InputError for a missing or impossible value and
    for a lens model that a pinhole with Brown's distortion cannot express.
    """
    tree = read_tree(path)
    if any(key in tree for key in _K_NAMES):
        K, distortion, own_size = _ros_or_opencv(tree, path)
    elif "intrinsics" in tree and isinstance(tree["intrinsics"], dict):
        K, distortion, own_size = _four_numbers(tree["intrinsics"], path), np.zeros(5), None
    elif any(isinstance(entry, dict) and "camera_model" in entry for entry in tree.values()):
        K, distortion, own_size = _kalibr(tree, path, name)
    else:
        raise InputError(
            f"{path}: no camera in it; it takes 'camera_matrix' (ROS, OpenCV), a camchain of "
            f"Kalibr, or 'intrinsics' with fx, fy, cx, cy; it holds {', '.join(tree) or 'nothing'}"
        )
    if own_size and size and own_size != size:
        raise InputError(
            f"{path}: the camera is given for {own_size[0]}x{own_size[1]} px, the pictures have "
            f"{size[0]}x{size[1]} px"
        )
    if not (own_size or size):
        raise InputError(f"{path}: keys 'image_width' and 'image_height' are missing")
    width, height = own_size or size or (0, 0)
    return _checked(Camera(K, width, height, distortion), path)


def _ros_or_opencv(
    tree: Mapping[str, Any], path: Path
) -> tuple[Array, Array, tuple[int, int] | None]:
    K = numbers(item(tree, path, *_K_NAMES), path, _K_NAMES[0], 9).reshape(3, 3)
    model = str(tree.get("distortion_model", ""))
    if model not in _PINHOLE or tree.get("fisheye_model"):
        raise _unsupported(path, "distortion_model", model or "fisheye")
    distortion = np.zeros(5)
    if model != "none":
        distortion = numbers(item(tree, path, *_D_NAMES), path, _D_NAMES[0])
    sides = [next((tree[key] for key in keys if key in tree), None) for keys in (_WIDTHS, _HEIGHTS)]
    if sides == [None, None]:
        return K, distortion, None
    width, height = numbers(sides, path, "image_width, image_height", 2)
    return K, distortion, (int(width), int(height))


def _four_numbers(block: Mapping[str, Any], path: Path) -> Array:
    fx, fy, cx, cy = (
        numbers([item(block, path, key)], path, f"intrinsics.{key}", 1)[0]
        for key in ("fx", "fy", "cx", "cy")
    )
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def _kalibr(
    tree: Mapping[str, Any], path: Path, name: str | None
) -> tuple[Array, Array, tuple[int, int] | None]:
    cameras = {key: entry for key, entry in tree.items() if isinstance(entry, dict)}
    if name is None and len(cameras) > 1:
        raise InputError(
            f"{path}: it holds {', '.join(cameras)}; name one as camera_in_file in [camera]"
        )
    chosen = name or next(iter(cameras))
    if chosen not in cameras:
        raise InputError(f"{path}: no camera '{chosen}'; {did_you_mean(chosen, cameras)}")
    entry = cameras[chosen]
    if item(entry, path, "camera_model") != "pinhole":
        raise _unsupported(path, f"{chosen}.camera_model", entry["camera_model"])
    model = item(entry, path, "distortion_model")
    if model not in ("radtan", "none"):
        raise _unsupported(path, f"{chosen}.distortion_model", model)
    distortion = np.zeros(5)
    if model == "radtan":
        coefficients = item(entry, path, "distortion_coeffs")
        distortion = numbers(coefficients, path, f"{chosen}.distortion_coeffs", 4)
    fx, fy, cx, cy = numbers(item(entry, path, "intrinsics"), path, f"{chosen}.intrinsics", 4)
    width, height = numbers(item(entry, path, "resolution"), path, f"{chosen}.resolution", 2)
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    return K, distortion, (int(width), int(height))


def _unsupported(path: Path, key: str, model: Any) -> InputError:
    return InputError(
        f"{path}: '{key}' = {model!r} is not supported; it takes a pinhole with radial and "
        "tangential distortion (plumb_bob, rational_polynomial, radtan) or none"
    )


def _checked(camera: Camera, path: Path) -> Camera:
    K, width, height = camera.K, camera.width, camera.height
    if width < 1 or height < 1 or max(width, height) > 100_000:
        raise InputError(f"{path}: a picture of {width}x{height} px cannot be")
    if K[0, 0] <= 0 or K[1, 1] <= 0 or np.abs(K[[1, 2, 2, 2], [0, 0, 1, 2]] - [0, 0, 0, 1]).any():
        raise InputError(
            f"{path}: the camera matrix {K.tolist()} is none; it has to be fx s cx, 0 fy cy, 0 0 1"
        )
    if not (0 <= K[0, 2] <= width and 0 <= K[1, 2] <= height):
        raise InputError(
            f"{path}: the principal point ({K[0, 2]:.6g}, {K[1, 2]:.6g}) lies outside of the "
            f"{width}x{height} px picture"
        )
    count = len(camera.distortion)
    if count not in _COUNTS:
        raise InputError(
            f"{path}: {count} distortion coefficients; it takes {', '.join(map(str, _COUNTS))}"
        )
    padded = np.pad(camera.distortion, (0, max(0, 5 - count)))
    return Camera(K, width, height, padded)


# -- Writing -----------------------------------------------------------------------------


def write_camera(camera: Camera, path: Path, form: CameraForm, name: str = "camera") -> None:
    """A camera as a file of another tool; OpenCV's may end in .yaml, .xml or .json.

    Raises InputError where the form cannot hold the camera without loss.
    """
    if form == "ros":
        path.write_text(_ros_text(camera, path, name), encoding="utf-8")
    elif form == "kalibr":
        path.write_text(_kalibr_text(camera, path, name), encoding="utf-8")
    elif form == "opencv":
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
        storage.write("image_width", camera.width)
        storage.write("image_height", camera.height)
        storage.write("camera_matrix", np.array(camera.K))
        storage.write("distortion_coefficients", np.array(camera.distortion)[:, None])
        storage.release()
    else:
        forms = get_args(CameraForm)
        raise InputError(f"camera form {form!r} is unknown; {did_you_mean(str(form), forms)}")


def _ros_text(camera: Camera, path: Path, name: str) -> str:
    count = len(camera.distortion)
    if count not in (5, 8):
        raise InputError(f"{path}: ROS holds 5 or 8 distortion coefficients, not {count}")
    P = np.hstack([camera.K, np.zeros((3, 1))])
    blocks = [
        ("camera_matrix", camera.K),
        ("distortion_coefficients", camera.distortion[None]),
        ("rectification_matrix", np.eye(3)),
        ("projection_matrix", P),
    ]
    model = "plumb_bob" if count == 5 else "rational_polynomial"
    lines = [
        f"image_width: {camera.width}",
        f"image_height: {camera.height}",
        f"camera_name: {name}",
        f"distortion_model: {model}",
    ]
    for key, M in blocks:
        lines += [f"{key}:", f"  rows: {M.shape[0]}", f"  cols: {M.shape[1]}"]
        lines += [f"  data: {_listed(M)}"]
    return "\n".join(lines) + "\n"


def _kalibr_text(camera: Camera, path: Path, name: str) -> str:
    if np.any(camera.distortion[4:]) or camera.K[0, 1]:
        raise InputError(
            f"{path}: Kalibr's radtan holds k1, k2, p1, p2 and no skew; "
            f"distortion {camera.distortion.tolist()}, skew {camera.K[0, 1]:g} would be cut"
        )
    K = camera.K
    return (
        f"{name}:\n"
        "  camera_model: pinhole\n"
        f"  intrinsics: {_listed(K[[0, 1, 0, 1], [0, 1, 2, 2]])}\n"
        "  distortion_model: radtan\n"
        f"  distortion_coeffs: {_listed(camera.distortion[:4])}\n"
        f"  resolution: [{camera.width}, {camera.height}]\n"
    )


def _listed(values: Array) -> str:
    return "[" + ", ".join(repr(float(value)) for value in np.ravel(values)) + "]"
