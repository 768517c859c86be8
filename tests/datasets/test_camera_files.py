"""Camera files of other tools, as they write them, and round trips."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aoicell.camera import Camera
from aoicell.datasets.camera_files import CameraForm, read_camera, write_camera
from aoicell.errors import InputError

K = np.array([[1400.5, 0, 790.25], [0, 1410.0, 610.0], [0, 0, 1]])
BENT = np.array([-0.08, 0.02, 1e-3, -2e-3, 0.01])

ROS = """image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [550.5, 0.0, 320.0,
         0.0, 551.0, 240.0,
         0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.1, -0.2, 0.001, 0.002, 0.05]}
"""
OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 550.5, 0., 320., 0., 551., 240., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ 0.1, -0.2, 0.001, 0.002, 0.05 ]
"""
KALIBR = """cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [0.1, -0.2, 0.001, 0.002]
  distortion_model: radtan
  intrinsics: [550.5, 551.0, 320.0, 240.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.99, 0.001, 0.002, -0.1]
  - [0.0, 1.0, 0.01, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [700.0, 701.0, 321.0, 241.0]
  resolution: [640, 480]
"""
INDUSTRIAL = "intrinsics:\n  fx: 550.5 # pixels\n  fy: 551.0\n  cx: 320.0\n  cy: 240.0\n"


def read(folder: Path, text: str, name: str | None = None,
         size: tuple[int, int] | None = None) -> Camera:  # fmt: skip
    (folder / "c.yaml").write_text(text, encoding="utf-8")
    return read_camera(folder / "c.yaml", name, size)


@pytest.mark.parametrize(
    ("text", "name", "k3"), [(ROS, None, 0.05), (OPENCV, None, 0.05), (KALIBR, "cam0", 0.0)]
)
def test_the_files_of_other_tools(tmp_path: Path, text: str, name: str | None, k3: float) -> None:
    camera = read(tmp_path, text, name)
    assert (camera.width, camera.height) == (640, 480)
    np.testing.assert_array_equal(camera.K, [[550.5, 0, 320], [0, 551, 240], [0, 0, 1]])
    np.testing.assert_allclose(camera.distortion, [0.1, -0.2, 0.001, 0.002, k3], rtol=1e-15)


def test_a_file_without_a_size_takes_that_of_the_pictures(tmp_path: Path) -> None:
    camera = read(tmp_path, INDUSTRIAL, size=(640, 480))
    assert (camera.width, camera.height) == (640, 480)
    np.testing.assert_array_equal(camera.K, [[550.5, 0, 320], [0, 551, 240], [0, 0, 1]])
    assert not camera.distortion.any()
    with pytest.raises(InputError, match="'image_width' and 'image_height' are missing"):
        read(tmp_path, INDUSTRIAL)


def test_one_camera_of_a_chain_has_to_be_named(tmp_path: Path) -> None:
    assert read(tmp_path, KALIBR, "cam1").K[0, 0] == 700.0
    with pytest.raises(InputError, match="it holds cam0, cam1; name one as camera_in_file"):
        read(tmp_path, KALIBR)
    with pytest.raises(InputError, match=r"no camera 'cam2'; did you mean 'cam"):
        read(tmp_path, KALIBR, "cam2")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (ROS.replace("plumb_bob", "equidistant"), "'distortion_model' = 'equidistant' is not supp"),
        (OPENCV + "fisheye_model: 1\n", "'fisheye' is not supported"),
        (KALIBR.replace("pinhole", "omni", 1), "'cam0.camera_model' = 'omni' is not supported"),
        (KALIBR.replace("radtan", "equi", 1), "'cam0.distortion_model' = 'equi' is not supported"),
        (ROS.replace("550.5", ".nan"), "'camera_matrix' is"),
        (ROS.replace("550.5, ", ""), "it must be 9 finite numbers"),
        (ROS.replace("550.5", "-550.5"), "it has to be fx s cx, 0 fy cy, 0 0 1"),
        (ROS.replace("320.0", "3200.0"), "principal point (3200, 240) lies outside"),
        (ROS.replace("-0.2, 0.001, ", ""), "3 distortion coefficients; it takes 0, 4, 5, 8"),
        (ROS.replace("image_height: 480", "image_height: 0"), "640x0 px cannot be"),
        (ROS.replace("distortion_coefficients", "dist"), "key 'distortion_coefficients' is"),
        (ROS.replace("camera_matrix", "matrix"), "no camera in it"),
        (ROS + "image_width: 640\n", "key 'image_width' stands twice"),
        (ROS.replace("[550.5", "550.5"), "cannot be parsed"),
        ("", "no 'key: value' pairs"),
    ],
)  # fmt: skip
def test_what_is_no_camera_is_named(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text, "cam0")
    assert str(caught.value).startswith(str(tmp_path / "c.yaml"))
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_another_size_than_the_pictures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="given for 640x480 px, the pictures have 1280x960 px"):
        read(tmp_path, ROS, size=(1280, 960))


# -- Round trips -------------------------------------------------------------------------

FILES: list[tuple[CameraForm, str]] = [
    ("ros", "c.yaml"), ("opencv", "c.yml"), ("opencv", "c.xml"), ("opencv", "c.json"),
    ("kalibr", "c.yaml"),
]  # fmt: skip


@pytest.mark.parametrize(("form", "file"), FILES)
@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    focal=st.floats(100, 5000),
    centre=st.tuples(st.floats(0, 1600), st.floats(0, 1200)),
    distortion=st.lists(st.floats(-1, 1), min_size=5, max_size=5),
)
def test_what_is_written_reads_back(
    tmp_path: Path, form: CameraForm, file: str, focal: float, centre: tuple[float, float],
    distortion: list[float],
) -> None:  # fmt: skip
    K = np.array([[focal, 0, centre[0]], [0, focal * 1.01, centre[1]], [0, 0, 1]])
    if form == "kalibr":
        distortion[4] = 0
    camera = Camera(K, 1600, 1200, np.array(distortion))
    write_camera(camera, tmp_path / file, form)
    again = read_camera(tmp_path / file)
    assert (again.width, again.height) == (1600, 1200)
    np.testing.assert_allclose(again.K, K, rtol=1e-14)
    np.testing.assert_allclose(again.distortion, distortion, rtol=1e-14, atol=1e-300)


def test_eight_coefficients(tmp_path: Path) -> None:
    camera = Camera(K, 1600, 1200, np.arange(8) / 100)
    for form in ("ros", "opencv"):
        write_camera(camera, tmp_path / "c.yaml", form)
        np.testing.assert_allclose(
            read_camera(tmp_path / "c.yaml").distortion, camera.distortion, rtol=1e-15
        )


@pytest.mark.parametrize(
    ("form", "count", "reason"),
    [
        ("kalibr", 5, "k1, k2, p1, p2 and no skew"),
        ("ros", 12, "5 or 8 distortion coefficients, not 12"),
        ("rso", 5, "camera form 'rso' is unknown; did you mean 'ros'?"),
    ],
)
def test_nothing_is_lost_silently(
    tmp_path: Path, form: CameraForm, count: int, reason: str
) -> None:
    camera = Camera(K, 1600, 1200, np.full(count, 0.01))
    with pytest.raises(InputError, match=reason.replace("?", r"\?")):
        write_camera(camera, tmp_path / "c.yaml", form)
    assert not (tmp_path / "c.yaml").exists()


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    text=st.sampled_from([ROS, OPENCV, KALIBR, INDUSTRIAL]), data=st.data(),
    mark=st.sampled_from(["", "x", "-", "[", "]", ":", "\n", "nan", "1e400", '"', "{", "\t", "0"]),
)  # fmt: skip
def test_any_file_is_a_camera_or_one_sentence(
    tmp_path: Path, text: str, data: st.DataObject, mark: str
) -> None:
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 12)))
    try:
        message = ""
        assert read(tmp_path, text[:start] + mark + text[end:], size=(640, 480)).K.shape == (3, 3)
    except InputError as error:
        message = f"{error}"
    assert "\n" not in message
    assert not message or str(tmp_path) in message
