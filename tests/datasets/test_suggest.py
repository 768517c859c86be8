"""Recordings read in the wrong way, and what is suggested."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from aoicell.datasets.manifest import PoseFormat
from aoicell.datasets.pose_writer import write_poses
from aoicell.datasets.suggest import Reading, any_reading, suggest
from aoicell.errors import InputError
from aoicell.transforms import SE3, from_rvec

from .robots import MANIFEST, arm_and_target_poses, write_manifest, write_pictures

IDS = [f"{k}" for k in range(1, 11)]
FACTS = {
    "mount": "eye_in_hand", "pose_meaning": "T_base_flange", "length_unit": "m",
    "pose_format": "matrix4x4_row_major", "pairing": "order",
}  # fmt: skip


def record(
    folder: Path, arms: Sequence[SE3], pose_format: PoseFormat = "matrix4x4_row_major"
) -> None:
    write_pictures(folder / "images", IDS)
    write_poses(folder / "poses.csv", dict(zip(IDS, arms, strict=False)), pose_format)


def noisy(Ts: Sequence[SE3], rng: np.random.Generator) -> dict[str, SE3]:
    """T_camera_target by view with about 1 mm and 0.1 deg of noise."""
    noise = [from_rvec(2e-3 * rng.standard_normal(3), 1e-3 * rng.standard_normal(3)) for _ in Ts]
    return {id: T * dT for id, T, dT in zip(IDS, Ts, noise, strict=True)}


def assert_best(readings: Sequence[Reading], *changes: str) -> None:
    best = readings[0]
    assert best.changes == changes, [str(reading) for reading in readings[:4]]
    assert best.scatter_mm < 5
    assert best.views == len(IDS)
    tied = [r for r in readings if r.scatter_mm == best.scatter_mm]
    others = [r for r in readings if r not in tied]
    assert min(r.scatter_mm for r in others) > 50


def test_a_sound_manifest_stays(tmp_path: Path, rng: np.random.Generator) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, arms)
    readings = suggest(write_manifest(tmp_path), noisy(seen, rng))
    assert_best(readings[:1] + [r for r in readings if 'pairing = "name"' not in str(r)][1:])
    assert str(readings[0]).endswith("over 10 views, the part on the flange 80 mm from it: "
                                     "as the manifest stands")  # fmt: skip


@pytest.mark.parametrize("mount", ["eye_in_hand", "eye_to_hand"])
def test_the_other_mount(tmp_path: Path, rng: np.random.Generator, mount: str) -> None:
    arms, seen = arm_and_target_poses(mount)
    record(tmp_path, arms)
    wrong = "eye_to_hand" if mount == "eye_in_hand" else "eye_in_hand"
    readings = suggest(write_manifest(tmp_path, mount=wrong, pairing="name"), noisy(seen, rng))
    consistent = [r for r in readings if r.scatter_mm == readings[0].scatter_mm]
    changes = {r.changes[:1] for r in consistent if len(r.changes) == 1}
    assert changes == {(f'mount = "{mount}"',), (_meaning("T_flange_base"),)}


def _meaning(value: str) -> str:
    return f'[views] pose_meaning = "{value}"'


def test_the_part_on_the_flange_sits_close_to_it(tmp_path: Path) -> None:
    """Two readings are equally consistent: the camera is 80 mm or 1 m from the flange."""
    arms, seen = arm_and_target_poses()
    record(tmp_path, [T.inverse() for T in arms])
    path = write_manifest(tmp_path, pairing="name")
    readings = suggest(path, dict(zip(IDS, seen, strict=True)))
    first, second = readings[:2]
    assert first.changes == (_meaning("T_flange_base"),)
    assert first.mounted_mm == pytest.approx(80, abs=1)
    assert second.changes == ('mount = "eye_to_hand"',)
    assert second.mounted_mm == pytest.approx(1003, abs=2)
    assert first.scatter_mm == second.scatter_mm < 1e-5


@pytest.mark.parametrize(("unit", "scale"), [("m", 1e3), ("mm", 1.0)])
def test_the_unit(tmp_path: Path, rng: np.random.Generator, unit: str, scale: float) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, [SE3(T.rotation, T.translation * scale) for T in arms])
    path = write_manifest(tmp_path, length_unit=unit, pairing="name")
    readings = suggest(path, noisy(seen, rng))
    right = "mm" if unit == "m" else "m"
    assert readings[0].changes == (f'[views] length_unit = "{right}"',)
    as_it_stands = next(r for r in readings if not r.changes)
    assert as_it_stands.scatter_mm == np.inf
    assert "from its origin" in as_it_stands.reason


def test_the_order_of_a_quaternion(tmp_path: Path, rng: np.random.Generator) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, arms, "xyz_quat_xyzw")
    lines = (tmp_path / "poses.csv").read_text().splitlines()
    (tmp_path / "poses.csv").write_text("\n".join(x.split(",", 1)[1] for x in lines[1:]))
    path = write_manifest(tmp_path, pose_format="xyz_quat_wxyz")
    assert_best(suggest(path, noisy(seen, rng)), '[views] pose_format = "xyz_quat_xyzw"')


def test_reversed_poses(tmp_path: Path, rng: np.random.Generator) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, arms[::-1])
    best = suggest(write_manifest(tmp_path), noisy(seen, rng))[0]
    assert "the poses stand in reverse order" in best.changes[0]
    assert best.scatter_mm < 5


@pytest.mark.parametrize("shift", [-2, -1, 1, 2])
def test_shifted_poses(tmp_path: Path, rng: np.random.Generator, shift: int) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, [arms[(k - shift) % 10] for k in range(10)])
    best = suggest(write_manifest(tmp_path), noisy(seen, rng))[0]
    assert best.changes[0].startswith(f"picture k belongs to pose k {shift:+d}:")
    assert best.scatter_mm < 5
    assert best.views == 10 - abs(shift)


def test_a_pose_too_few_at_the_start(tmp_path: Path, rng: np.random.Generator) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, arms[1:])
    best = suggest(write_manifest(tmp_path), noisy(seen, rng))[0]
    assert best.changes[0].startswith("picture k belongs to pose k -1:")
    assert best.scatter_mm < 5


def test_two_mistakes_at_once(tmp_path: Path, rng: np.random.Generator) -> None:
    arms, seen = arm_and_target_poses()
    inverses = [T.inverse() for T in arms]
    record(tmp_path, [SE3(T.rotation, T.translation * 1e3) for T in inverses])
    best = suggest(write_manifest(tmp_path, pairing="name"), noisy(seen, rng))[0]
    assert best.changes == (_meaning("T_flange_base"), '[views] length_unit = "mm"')


def test_missing_conventions_are_suggested(tmp_path: Path, rng: np.random.Generator) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, arms)
    lines = [line for line in MANIFEST.splitlines() if line.split(" = ")[0] not in FACTS]
    path = write_manifest(tmp_path, "\n".join(lines))
    recording = any_reading(path)
    assert [view.id for view in recording.views] == IDS
    best = suggest(path, noisy(seen, rng))[0]
    assert best.scatter_mm < 5
    assert set(best.changes) >= {_meaning("T_base_flange"), '[views] length_unit = "m"',
                                 'mount = "eye_in_hand"'}  # fmt: skip


def test_views_without_a_target_are_left_out(tmp_path: Path, rng: np.random.Generator) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, arms)
    Ts = noisy(seen, rng)
    for id in ("2", "7"):
        del Ts[id]
    best = suggest(write_manifest(tmp_path, pairing="name"), Ts)[0]
    assert (best.views, best.changes) == (8, ())
    assert all(r.reason for r in suggest(write_manifest(tmp_path, pairing="name"), {}))


def test_a_targets_own_mount_is_the_one_to_change(tmp_path: Path) -> None:
    arms, seen = arm_and_target_poses()
    record(tmp_path, arms)
    text = MANIFEST.replace("rows = 6", 'rows = 6\nmount = "eye_to_hand"')
    readings = suggest(write_manifest(tmp_path, text), dict(zip(IDS, seen, strict=True)))
    assert readings[0].changes == ('[[target]] mount = "eye_in_hand"',)


def test_pose_pairs_bring_their_own(tmp_path: Path) -> None:
    arms, seen = arm_and_target_poses("eye_to_hand")
    samples = [[A.homogeneous.tolist(), B.homogeneous.tolist()]
               for A, B in zip(arms, seen, strict=True)]  # fmt: skip
    (tmp_path / "s.json").write_text(json.dumps(samples))
    path = write_manifest(
        tmp_path,
        'mount = "eye_in_hand"\n[views]\npairs = "s.json"\npair_format = "json_effector_and_object"'
        '\npose_meaning = "T_base_flange"\nlength_unit = "m"',
    )
    readings = suggest(path)
    assert {r.changes for r in readings[:2]} == {
        ('mount = "eye_to_hand"',), (_meaning("T_flange_base"),)
    }  # fmt: skip
    assert readings[2].scatter_mm > 50
    assert all(r.reason for r in readings if any("mm" in change for change in r.changes))


def test_what_no_reading_mends_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        suggest(write_manifest(tmp_path), {})
    with pytest.raises(InputError, match=r"'target.0.columns' = 'many'"):
        any_reading(write_manifest(tmp_path, columns="many"))
    with pytest.raises(InputError, match=r"'views.length_unit' = 'inch': give one of 'm', 'mm'"):
        suggest(write_manifest(tmp_path, length_unit="inch"), {})
