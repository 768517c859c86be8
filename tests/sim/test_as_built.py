"""Each knob draws from a stream of its own, in its unit and in its frame."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from aoicell.nominal import Nominal
from aoicell.sim.as_built import AsBuilt, Geometry, designed
from aoicell.sim.drawing import draw, stream
from aoicell.sim.profiles import IDEAL, PAPER
from aoicell.sim.tolerances import Tolerances
from aoicell.transforms import Array, from_xyz_rpy

EVERYTHING = PAPER.model_copy(update={"axis_deg": 0.02})  # what the paper leaves at zero, too


def parts(geometry: Geometry) -> dict[str, Array]:
    """All that is drawn, as plain numbers."""
    poses = {
        "camera": geometry.T_flange_camera,
        "armtarget": geometry.T_flange_armtarget,
        "tabletarget": geometry.T_base_tabletarget,
        "tripod": geometry.T_base_tripod,
        "board": geometry.T_base_board,
        **{f"link_{i}": T for i, T in enumerate(geometry.joint_corrections)},
        **geometry.Ts_board_marker,
    }
    found = {"joint_offsets": geometry.joint_offsets}
    for name, T in poses.items():
        found[f"{name}.xyz"], found[f"{name}.R"] = T.translation, T.rotation
    for name, camera in geometry.cameras.items():
        found[f"{name}.f"] = camera.K[[0, 1], [0, 1]]
        found[f"{name}.c"] = camera.K[:2, 2]
        found[f"{name}.k"] = camera.distortion
    return found


def owned(knob: str, name: str) -> bool:
    """Whether the knob is the one that moves this part."""
    what, _, quantity = name.partition(".")
    moved = "xyz" if knob.endswith("_mm") else "R"
    owners = {
        "joint_zero_deg": name == "joint_offsets",
        "link_mm": what.startswith("link_") and quantity == "xyz",
        "axis_deg": what.startswith("link_") and quantity == "R",
        "mount_bias_x_mm": name == "camera.xyz",
        "mount_bias_z_mm": name == "camera.xyz",
        "focal_percent": quantity == "f",
        "principal_px": quantity == "c",
        "k1": quantity == "k",
        "k1_sigma": quantity == "k",
        "repeatability_mm": False,
        "noise_grey": False,
    }
    if knob in owners:
        return owners[knob]
    holders: Mapping[str, tuple[str, ...]] = {
        "mount": ("camera",),
        "placement": ("tabletarget", "board"),
        "tripod": ("tripod",),
        "bracket": ("armtarget",),
        "marker": ("M1", "M2", "M3", "M4"),
    }
    return what in holders[knob.partition("_")[0]] and quantity == moved


def changed(one: AsBuilt, other: AsBuilt) -> set[str]:
    a, b = parts(one.geometry), parts(other.geometry)
    return {name for name in a if not np.array_equal(a[name], b[name])}


def test_ideal_is_the_design_to_the_last_bit(nominal: Nominal) -> None:
    ideal, design = parts(draw(nominal, IDEAL, 3).geometry), parts(designed(nominal))
    for name, value in design.items():
        np.testing.assert_array_equal(ideal[name], value, err_msg=name)


def test_the_same_seed_gives_the_same_bits(nominal: Nominal) -> None:
    draw(nominal, EVERYTHING, 8)  # whatever was drawn before
    assert changed(draw(nominal, EVERYTHING, 7, 2), draw(nominal, EVERYTHING, 7, 2)) == set()


@pytest.mark.parametrize(("seed", "world"), [(8, 2), (7, 3)])
def test_another_seed_or_world_changes_everything(nominal: Nominal, seed: int, world: int) -> None:
    one, other = draw(nominal, EVERYTHING, 7, 2), draw(nominal, EVERYTHING, seed, world)
    assert changed(one, other) == set(parts(one.geometry))


@pytest.mark.parametrize("knob", list(Tolerances.model_fields))
def test_a_knob_switched_off_changes_no_other_draw(nominal: Nominal, knob: str) -> None:
    full = draw(nominal, EVERYTHING, 11)
    without = draw(nominal, EVERYTHING.model_copy(update={knob: 0.0}), 11)
    assert changed(full, without) == {name for name in parts(full.geometry) if owned(knob, name)}


@pytest.mark.parametrize("knob", list(Tolerances.model_fields))
def test_a_knob_alone_moves_its_own_part_from_the_design(nominal: Nominal, knob: str) -> None:
    alone = draw(nominal, Tolerances.model_validate({knob: 0.1}), 11)
    design = draw(nominal, IDEAL, 11)
    assert changed(alone, design) == {name for name in parts(design.geometry) if owned(knob, name)}


def test_no_two_quantities_share_a_stream(nominal: Nominal) -> None:
    geometry = draw(nominal, EVERYTHING, 1).geometry
    moves = [T.translation for T in geometry.joint_corrections]
    moves += [geometry.T_base_tripod.translation - nominal.T_base_tripod.translation]
    moves = [move / np.linalg.norm(move) for move in moves]
    cosines = np.abs(np.triu(np.array(moves) @ np.array(moves).T, 1))
    assert cosines.max() < 0.99999
    hand, tripod = (
        geometry.cameras[name].focal_px / nominal.cameras[name].focal_px
        for name in ("hand", "tripod")
    )
    assert hand != tripod


def test_streams_are_keyed_by_everything() -> None:
    keys = [(0, 0, -1, "a"), (1, 0, -1, "a"), (0, 1, -1, "a"), (0, 0, 0, "a"), (0, 0, -1, "b")]
    values = [stream(*key).standard_normal() for key in keys]
    assert len(set(values)) == len(keys)
    assert stream(*keys[0]).standard_normal() == values[0]


@pytest.fixture(scope="module")
def many(nominal: Nominal) -> list[dict[str, Array]]:
    return [parts(draw(nominal, EVERYTHING, 5, world).geometry) for world in range(300)]


def deviations(nominal: Nominal, many: list[dict[str, Array]], name: str) -> Array:
    """Deviations from the design, in its parent's axes: mm, deg, px or percent."""
    design = parts(designed(nominal))[name]
    if name.endswith(".R"):
        turns = Rotation.from_matrix([design.T @ m[name] for m in many])
        return np.asarray(turns.as_rotvec(degrees=True))
    if name.endswith(".f"):
        return np.array([m[name] / design - 1 for m in many]) * 100
    scale = 1e3 if name.endswith(".xyz") else 1.0
    return np.array([m[name] - design for m in many]) * scale


@pytest.mark.parametrize(
    ("name", "sigma", "mean"),
    [
        ("joint_offsets", np.radians(0.1), 0),
        ("link_0.xyz", 0.5, 0),
        ("link_6.xyz", 0.5, 0),
        ("link_3.R", 0.02, 0),
        ("camera.xyz", 0.5, [9, 0, 2]),
        ("camera.R", 0.7, 0),
        ("armtarget.xyz", 0.5, 0),
        ("armtarget.R", 0.3, 0),
        ("tabletarget.xyz", [5, 5, 0], 0),
        ("tabletarget.R", [0, 0, 1], 0),
        ("board.xyz", [5, 5, 0], 0),
        ("board.R", [0, 0, 1], 0),
        ("tripod.xyz", 30, 0),
        ("tripod.R", 1, 0),
        ("M2.xyz", [0.5, 0.5, 0], 0),
        ("M2.R", [0, 0, 0.5], 0),
        ("hand.f", 1.0, 0),
        ("tripod.f", 1.0, 0),
        ("hand.c", 10, 0),
        ("hand.k", [0.02, 0, 0, 0, 0], [-0.08, 0, 0, 0, 0]),
    ],
)
def test_the_spread_is_the_stated_one(
    nominal: Nominal, many: list[dict[str, Array]], name: str, sigma: float, mean: float
) -> None:
    found = deviations(nominal, many, name)
    expected, sigmas = np.zeros(found.shape[1]) + mean, np.zeros(found.shape[1]) + sigma
    count = len(many)
    assert (np.abs(found.mean(axis=0) - expected) <= 4 * sigmas / np.sqrt(count) + 1e-9).all()
    spread = np.sqrt(((found - expected) ** 2).mean(axis=0))
    assert (np.abs(spread - sigmas) <= 4 * sigmas / np.sqrt(2 * count) + 1e-9).all()


def test_a_focal_length_scales_both_axes(many: list[dict[str, Array]]) -> None:
    for m in many[:5]:
        assert m["hand.f"][0] == m["hand.f"][1]


def test_the_holders_bias_is_along_the_flanges_axes(nominal: Nominal) -> None:
    turned = replace(nominal, T_flange_camera=from_xyz_rpy([0, 0, 0.05], [0, 0, np.pi / 2]))
    bias = Tolerances(mount_bias_x_mm=9.0, mount_bias_z_mm=2.0)
    T = draw(turned, bias, 0).geometry.T_flange_camera
    np.testing.assert_allclose(T.translation, [0.009, 0, 0.052], atol=1e-15)
    np.testing.assert_array_equal(T.rotation, turned.T_flange_camera.rotation)


def test_hand_placed_things_stay_on_the_table(nominal: Nominal) -> None:
    geometry = draw(nominal, PAPER, 4).geometry
    for T, design in (
        (geometry.T_base_board, nominal.T_base_board),
        (geometry.T_base_tabletarget, nominal.T_base_tabletarget),
    ):
        assert T.translation[2] == pytest.approx(design.translation[2], abs=1e-12)
        np.testing.assert_allclose(T.rotation[:, 2], [0, 0, 1], atol=1e-12)


def test_repeatability_and_noise_are_handed_on(nominal: Nominal) -> None:
    as_built = draw(nominal, Tolerances(repeatability_mm=0.36, noise_grey=2.0), 5, 6)
    assert as_built.arrival.repeatability_sigma == pytest.approx(1e-4)
    assert (as_built.sensors["hand"].noise_grey, as_built.seed, as_built.world) == (2.0, 5, 6)
