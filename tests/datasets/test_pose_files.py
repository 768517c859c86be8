"""Tables and folders of poses, as they come from elsewhere and as they are written."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aoicell.datasets.manifest import PoseFormat
from aoicell.datasets.pose_files import read_pairs, read_poses
from aoicell.datasets.pose_writer import write_poses
from aoicell.datasets.poses import COLUMNS
from aoicell.errors import InputError
from aoicell.transforms import SE3, rotation, translation

FORMATS: tuple[PoseFormat, ...] = tuple(COLUMNS)
QUARTER = translation(1, 2, 3) * rotation("z", np.pi / 2)


def read(folder: Path, pattern: str, pose_format: PoseFormat, by_name: bool = False) -> list[SE3]:
    found = read_poses(folder, pattern, pose_format, "m.toml: 'views.poses'", by_name)
    return [pose.T for pose in found]


def complaint(folder: Path, text: str, pose_format: PoseFormat, by_name: bool = False) -> str:
    (folder / "p.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read(folder, "p.csv", pose_format, by_name)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(folder / "p.csv"))
    return message.removeprefix(str(folder / "p.csv"))


@pytest.mark.parametrize(
    ("name", "pose_format", "text"),
    [
        ("1.yaml", "named_quat", "qw: 0.70710678 # w\ny: 2.\nx: 1\nqx: 0\nqy: 0\n"
                                 "qz: 0.70710678\nz: 3"),
        ("1.yaml", "visp_vector", "rows: 6\ncols: 1\ndata:\n  - [1]\n  - [2]\n  - [3]\n  - [0]\n"
                                  "  - [0]\n  - [1.57079633]\n"),
        ("1.yaml", "visp_vector", "rows: 6\ncols: 1\ndata:\n- [1]\n- [2]\n- [3]\n- [0]\n"
                                  "- [0]\n- [1.57079633]\n"),
        ("1.pos", "visp_vector", "1 2 3 0 0 1.57079633\n"),
        ("1.txt", "matrix4x4_row_major", "0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n"),
        ("1.csv", "matrix4x4_row_major", "0,-1,0,1\n1,0,0,2\n0,0,1,3\n0,0,0,1\n"),
        ("1.txt", "xyz_quat_wxyz", "# made by hand\n1, 2, 3, 0.70710678, 0, 0, 0.70710678"),
        ("1.yml", "opencv_yaml", "%YAML:1.0\n---\nT: !!opencv-matrix\n   rows: 4\n   cols: 4\n"
         "   dt: d\n   data: [ 0., -1., 0., 1., 1., 0., 0., 2.,\n"
         "       0., 0., 1., 3., 0., 0., 0., 1. ]\n"),
    ],
)  # fmt: skip
def test_files_of_one_view(tmp_path: Path, name: str, pose_format: PoseFormat, text: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    (T,) = read(tmp_path, f"*{Path(name).suffix}", pose_format)
    assert T.isApprox(QUARTER, 1e-8)


@pytest.mark.parametrize(
    "text",
    [
        "1,2,3,0,0,0,1\n4,5,6,0,0,0,1\n",
        "1;2;3;0;0;0;1\n4;5;6;0;0;0;1\n",
        "1 2 3  0 0 0 1\n\n# then\n4 5 6 0 0 0 1",
        "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n4,5,6,0,0,0,1\n",
        "id,x,y,z,qx,qy,qz,qw\na,1,2,3,0,0,0,1\nb,4,5,6,0,0,0,1\n",
        '\ufeff"id","x","y","z","qx","qy","qz","qw"\n"a",1,2,3,0,0,0,1\n"b",4,5,6,0,0,0,1\n',
    ],
)
def test_tables(tmp_path: Path, text: str) -> None:
    (tmp_path / "p.csv").write_text(text, encoding="utf-8")
    first, second = read(tmp_path, "p.csv", "xyz_quat_xyzw")
    assert first.isApprox(translation(1, 2, 3))
    assert second.isApprox(translation(4, 5, 6))


def test_a_table_of_named_quaternions_takes_any_order(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(
        "qw,id,qx,qy,qz,z,y,x\n0.70710678,a,0,0,0.70710678,3,2,1\n", encoding="utf-8"
    )
    (pose,) = read_poses(tmp_path, "p.csv", "named_quat", "it", by_name=True)
    assert pose.id == "a"
    assert pose.T.isApprox(QUARTER, 1e-8)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1,2,3,0,0,0,1\n1,2,3,0,0,0\n", ", line 2: 6 numbers; a pose in format"),
        ("1,2,3,0,0,0,1\n1,2,x,0,0,0,1\n", ", line 2: 'x' is no number"),
        ("1,2,3,0,0,0,1\n\n1,2,nan,0,0,0,1\n", ", line 3: nan is no finite number"),
        ("id,x,y,z,qw,qx,qy,qz\n", ", line 1: the header x y z qw qx qy qz contradicts"),
        ("id,a,b,c,d,e,f,g\nv,1,2,3,0,0,0\n", ", line 2: 7 cells; the header names 8"),
        ("id,x,x,z,qx,qy,qz,qw\n", ", line 1: a column stands twice"),
        ("", ": no poses in it"),
    ],
)  # fmt: skip
def test_a_bad_table_names_the_line(tmp_path: Path, text: str, reason: str) -> None:
    assert complaint(tmp_path, text, "xyz_quat_xyzw").startswith(reason)


def test_a_storage_file_without_matrices_holds_no_poses(tmp_path: Path) -> None:
    assert complaint(tmp_path, "a: 1\n", "opencv_yaml").startswith(": no poses in it")


def test_pairing_by_name_needs_a_column(tmp_path: Path) -> None:
    message = complaint(tmp_path, "1,2,3,0,0,0,1\n", "xyz_quat_xyzw", by_name=True)
    assert message.startswith(", line 1: no column 'id', which pairing by name needs")


def test_a_named_quaternion_has_all_its_keys(tmp_path: Path) -> None:
    (tmp_path / "1.yaml").write_text("x: 1\ny: 2\nz: 3\nqx: 0\nqy: 0\nqz: 0\nw: 1\n")
    with pytest.raises(InputError, match=r"1.yaml: key 'qw' is missing; did you mean 'w'\?"):
        read(tmp_path, "*.yaml", "named_quat")
    expected = ", line 1: column 'qw' is missing; named_quat needs a header"
    assert complaint(tmp_path, "x,y,z,qx,qy,qz,w\n", "named_quat").startswith(expected)


def test_a_storage_file_of_one_view_holds_one_matrix(tmp_path: Path) -> None:
    write_poses(tmp_path / "p.csv", {"a": QUARTER, "b": QUARTER}, "opencv_yaml")
    with pytest.raises(InputError, match=r"p.csv: 2 4x4 matrices \(a, b\)"):
        read(tmp_path, "*.csv", "opencv_yaml")


# -- Pose pairs --------------------------------------------------------------------------


def test_pairs_are_effector_and_object(tmp_path: Path) -> None:
    T = translation(4, 5, 6)
    text = json.dumps([[QUARTER.homogeneous.tolist(), T.homogeneous.tolist()]] * 2)
    (tmp_path / "s.json").write_text(text)
    pairs = read_pairs(tmp_path / "s.json")
    assert [arm.id for arm, _ in pairs] == ["1", "2"]
    assert pairs[0][0].T.isApprox(QUARTER)
    assert pairs[0][1].T.isApprox(T)


UNIT = np.eye(4).tolist()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("[", "s.json: not valid JSON"),
        ("[" * 100_000, "s.json: not valid JSON"),
        ("{}", "s.json: no list of samples"),
        ("[]", "s.json: no list of samples"),
        (json.dumps([[UNIT]]), "s.json, sample 1: not a pair"),
        (json.dumps([[UNIT, UNIT], [UNIT, 3]]), "s.json, sample 2, object: no 4x4 matrix"),
        (json.dumps([[UNIT, [["a"]]]]), "s.json, sample 1, object: no 4x4 matrix"),
        (json.dumps([[UNIT, UNIT]]).replace("1.0", "NaN", 1), "sample 1, effector: nan is no fin"),
        (json.dumps([[UNIT, UNIT]]).replace("1.0", "-1.0", 1), "sample 1, effector: the rotation"),
    ],
)
def test_bad_pairs_are_named(tmp_path: Path, content: str, reason: str) -> None:
    (tmp_path / "s.json").write_text(content)
    with pytest.raises(InputError) as caught:
        read_pairs(tmp_path / "s.json")
    assert reason in str(caught.value)


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    data=st.one_of(st.binary(max_size=60), st.text("0123456789.-e,;\n #xyzqw:[]", max_size=60)),
    pose_format=st.sampled_from(FORMATS),
    pattern=st.sampled_from(["p.csv", "*.csv"]),
    by_name=st.booleans(),
)
def test_any_file_is_poses_or_one_sentence(
    tmp_path: Path, data: bytes | str, pose_format: PoseFormat, pattern: str, by_name: bool
) -> None:
    content = data.encode() if isinstance(data, str) else data
    (tmp_path / "p.csv").write_bytes(content)
    try:
        message = ""
        assert read(tmp_path, pattern, pose_format, by_name)
    except InputError as error:
        message = f"{error}"
    assert not message or str(tmp_path) in message
    assert "\n" not in message
