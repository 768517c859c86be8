"""The cell as designed, as solids: what MuJoCo's scene has, and the room for the cables."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aoicell.errors import ModelError
from aoicell.nominal import Nominal
from aoicell.robot.collision import Solid
from aoicell.surroundings import collision_model, keep_out
from aoicell.transforms import apply, translation


def test_the_cables_have_room_behind_the_connectors(nominal: Nominal) -> None:
    (cables,) = keep_out(nominal)
    assert cables.mount == "flange"
    assert not isinstance(cables.shape, Path)
    half = np.array(cables.shape) / 2
    T_camera_solid = nominal.T_flange_camera.inverse() * cables.T_mount_solid
    low, high = apply(T_camera_solid, [-half, half])
    assert low[1] > 0.062, "beyond the connectors' end, so it is not the camera that is counted"
    assert high[2] < 0, "behind the entrance pupil: the camera does not see it"
    assert low[2] < -0.05 < high[2], "from beside the camera to behind the flange"


def test_a_camera_without_cables(second_cell: Nominal, tmp_path: Path) -> None:
    (tmp_path / "camera.toml").write_text("[sensor]\n")
    wireless = replace(second_cell, models={**second_cell.models, "hand": tmp_path})
    assert list(keep_out(wireless)) == []


@pytest.mark.parametrize("line", ["size_m = [0.1, 0.1]", 'size_m = "large"'])
def test_a_wrong_box_is_named(nominal: Nominal, tmp_path: Path, line: str) -> None:
    (tmp_path / "camera.toml").write_text(f'[[keep_out]]\nname = "x"\n{line}\n')
    other = replace(nominal, models={**nominal.models, "hand": tmp_path})
    with pytest.raises(ModelError, match=r"keep_out\[0\].size_m"):
        list(keep_out(other))


def test_what_else_is_there_counts(nominal: Nominal) -> None:
    place = nominal.arm.fk(nominal.q_home) * nominal.T_flange_camera * translation(z=0.1)
    lamp = Solid("lamp", (0.1, 0.1, 0.1), place)
    assert collision_model(nominal, 0.02).touching(nominal.q_home) is None
    assert collision_model(nominal, 0.06, [lamp]).touching(nominal.q_home) is not None
