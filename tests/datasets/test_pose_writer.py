"""Poses that are written read back the same."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aoicell.datasets.manifest import PoseFormat
from aoicell.datasets.pose_files import read_poses
from aoicell.datasets.pose_writer import write_poses
from aoicell.datasets.poses import COLUMNS
from aoicell.errors import InputError
from aoicell.transforms import SE3, from_xyz_rpy

FORMATS: tuple[PoseFormat, ...] = tuple(COLUMNS)

angles = st.floats(-np.pi, np.pi)
lengths = st.floats(-5000, 5000)
poses = st.builds(
    lambda x, y, z, r, p, w: from_xyz_rpy([x, y, z], [r, p, w]), *[lengths] * 3, *[angles] * 3
)


@pytest.mark.parametrize("pattern", ["table", "*.txt"])
@pytest.mark.parametrize("pose_format", FORMATS)
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(Ts=st.lists(poses, min_size=1, max_size=3))
def test_what_is_written_reads_back(
    tmp_path: Path, pose_format: PoseFormat, pattern: str, Ts: list[SE3]
) -> None:
    for old in tmp_path.iterdir():
        old.unlink()
    written = {f"v{k}": T for k, T in enumerate(Ts)}
    write_poses(tmp_path / pattern, written, pose_format)
    found = read_poses(tmp_path, pattern, pose_format, "it", by_name=True)
    assert [pose.id for pose in found] == list(written)
    for pose, T in zip(found, Ts, strict=True):
        assert np.abs(pose.T.homogeneous - T.homogeneous).max() < 1e-12


def test_a_matrix_in_a_storage_file_needs_a_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'1' cannot name a matrix"):
        write_poses(tmp_path / "q.yaml", {"1": SE3.Identity()}, "opencv_yaml")
