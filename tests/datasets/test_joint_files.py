"""Joint angles of a recording: written and read alike, and each flaw a sentence."""

from pathlib import Path

import numpy as np
import pytest
from helpers.recorded import cell

from aoicell.datasets.joint_files import read_arm, read_joints, write_joints
from aoicell.errors import InputError

NAMES = ("a", "b")


def test_what_is_written_reads_back(tmp_path: Path) -> None:
    joints = {"v1": np.array([0.1, -0.2]), "v2": np.array([1 / 3, 2.0])}
    write_joints(tmp_path / "j.csv", NAMES, joints)
    found = read_joints(tmp_path / "j.csv", NAMES, "rad")
    assert {id: q.tolist() for id, q in found.items()} == {
        id: q.tolist() for id, q in joints.items()
    }


def test_columns_go_by_name_and_degrees_are_turned(tmp_path: Path) -> None:
    (tmp_path / "j.csv").write_text("b;id;a\n90;x;180\n")
    np.testing.assert_allclose(
        read_joints(tmp_path / "j.csv", NAMES, "deg")["x"], [np.pi, np.pi / 2]
    )


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("id,a\nx,1\n", "column 'b' is missing"),
        ("", "column 'id' is missing"),
        ("id,a,b\nx,1\n", "2 cells; the header names 3"),
        ("id,a,b\nx,1,2\nx,1,2\n", "view 'x' stands twice"),
        ("id,a,b\nx,1,two\n", "not all numbers"),
        ("id,a,b\nx,1,nan\n", "not finite"),
        ("id,a,b\nx,1,90\n", "check 'joint_unit'"),
    ],
)
def test_flaws_are_named(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / "j.csv").write_text(text)
    with pytest.raises(InputError, match=complaint):
        read_joints(tmp_path / "j.csv", NAMES, "rad")


def test_the_urdf_is_named_by_the_manifest(tmp_path: Path) -> None:
    assert read_arm(cell().arm.urdf, "m").dof == 6
    with pytest.raises(InputError, match=r"m: .*no such file"):
        read_arm(tmp_path / "none.urdf", "m")
