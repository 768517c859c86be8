"""Each knob draws from a stream of its own, in its unit and in its frame."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from helpers.drawn_parts import (
    EVERYTHING,
    KNOBS,
    OWNED,
    SIGNED,
    distribution,
    drawn,
    geometry_parts,
    in_si,
    matches,
    owned,
    parts,
    shared,
    value,
)
from scipy.spatial.transform import Rotation

from aoicell.nominal import Nominal
from aoicell.sim.as_built import Arrival, Light, Sensor, designed
from aoicell.sim.drawing import LAMPS, draw, stream
from aoicell.sim.profiles import IDEAL
from aoicell.sim.tolerances import Tolerances
from aoicell.transforms import SE3, Array, from_xyz_rpy

ONLY_ABOUT_Z = ("M?.R", "tabletarget.R")
SPREADS = [knob for knob in KNOBS if distribution(knob) == "normal, sigma"]
HANDED_ON = [
    knob for knob in KNOBS if knob not in {*SPREADS, *SIGNED, "gradient_percent"}
]  # as they are: fixed, or drawn later


def changed(one: dict[str, Array], other: dict[str, Array]) -> set[str]:
    assert set(one) == set(other)
    return {name for name in one if not np.array_equal(one[name], other[name])}


def assert_same_bits(one: dict[str, Array], other: dict[str, Array], names: Iterable[str]) -> None:
    for name in names:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


@pytest.fixture(scope="module")
def design(nominal: Nominal) -> dict[str, Array]:
    return drawn(nominal)


@pytest.fixture(scope="module")
def full(nominal: Nominal) -> dict[str, Array]:
    return drawn(nominal, **EVERYTHING.model_dump())


# ---- the design --------------------------------------------------------------------------------


def test_ideal_is_the_design_to_the_last_bit(nominal: Nominal) -> None:
    ideal = draw(nominal, IDEAL, 3)
    found, expected = geometry_parts(ideal.geometry), geometry_parts(designed(nominal))
    assert changed(found, expected) == set()
    assert ideal.arrival == Arrival()
    assert set(ideal.sensors.values()) == {Sensor()}
    assert ideal.light == Light(turns=((0.0, 0.0, 0.0),) * LAMPS)
    ids = {component.id for component in nominal.board.components}
    assert ideal.surfaces.heights == dict.fromkeys(ids, 0.0)
    assert ideal.surfaces.brightness == dict.fromkeys(ids, 1.0)
    assert (ideal.surfaces.dust, ideal.surfaces.occlusion, ideal.surfaces.glare) == (0, 0, 0)


def test_every_knob_and_every_part_is_looked_at(full: dict[str, Array]) -> None:
    assert list(OWNED) == KNOBS
    assert all(value(knob) for knob in KNOBS)
    unowned = set(full).difference(*(owned(full, knob) for knob in KNOBS))
    assert unowned == {
        "lens_hand.rest", "lens_tripod.rest", "tabletarget.z",
        "sensor_tripod.focus", "sensor_tripod.focal_drift",
    }  # fmt: skip
    assert shared(full) == {"camera.x", "camera.z", "lens_hand.k1", "lens_tripod.k1"}


# ---- each knob for itself ----------------------------------------------------------------------


@pytest.mark.parametrize("knob", KNOBS)
def test_a_knob_alone_moves_its_own_part_from_the_design(
    nominal: Nominal, design: dict[str, Array], full: dict[str, Array], knob: str
) -> None:
    alone, mine = drawn(nominal, **{knob: value(knob)}), owned(design, knob)
    assert changed(alone, design) == mine != set()
    assert_same_bits(alone, full, mine - shared(mine))  # whatever else is switched on


@pytest.mark.parametrize("knob", KNOBS)
def test_a_knob_at_zero_changes_no_other_draw(
    nominal: Nominal, design: dict[str, Array], full: dict[str, Array], knob: str
) -> None:
    without, mine = drawn(nominal, **{**EVERYTHING.model_dump(), knob: 0.0}), owned(design, knob)
    assert changed(full, without) == mine
    assert_same_bits(without, design, mine - shared(mine))


@pytest.mark.parametrize(
    ("part", "one", "other"),
    [
        ("camera.x", "mount_bias_x_mm", "mount_mm"),
        ("camera.z", "mount_bias_z_mm", "mount_mm"),
        ("lens_hand.k1", "k1", "k1_sigma"),
        ("lens_tripod.k1", "k1", "k1_sigma"),
    ],
)
def test_two_knobs_of_one_part_add_up(
    nominal: Nominal, design: dict[str, Array], full: dict[str, Array],
    part: str, one: str, other: str,
) -> None:  # fmt: skip
    alone = [drawn(nominal, **{knob: value(knob)})[part] - design[part] for knob in (one, other)]
    assert full[part] - design[part] == pytest.approx(sum(alone), abs=1e-15)


@pytest.mark.parametrize("knob", SIGNED)
@pytest.mark.parametrize("sign", [1, -1])
def test_what_has_a_sign_goes_that_way(
    nominal: Nominal, design: dict[str, Array], knob: str, sign: int
) -> None:
    there = drawn(nominal, **{knob: sign * value(knob)})
    for name in owned(design, knob):
        assert there[name] - design[name] == pytest.approx(sign * in_si(knob), abs=1e-15), name


@pytest.mark.parametrize("knob", HANDED_ON)
def test_what_is_not_drawn_here_is_handed_on(full: dict[str, Array], knob: str) -> None:
    per_axis = 3.6 if knob == "repeatability_mm" else 1.0  # RP of ISO 9283
    for name in owned(full, knob):
        assert full[name] == pytest.approx(in_si(knob) / per_axis, rel=1e-12), name


# ---- seeds and streams -------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_bits(nominal: Nominal) -> None:
    draw(nominal, EVERYTHING, 8)  # whatever was drawn before
    one, other = (parts(draw(nominal, EVERYTHING, 7, 2)) for _ in range(2))
    assert changed(one, other) == set()


@pytest.mark.parametrize(("seed", "world"), [(8, 2), (7, 3)])
def test_another_seed_or_world_changes_all_that_is_drawn(
    nominal: Nominal, seed: int, world: int
) -> None:
    one, other = draw(nominal, EVERYTHING, 7, 2), draw(nominal, EVERYTHING, seed, world)
    names = parts(one)
    expected = {"light.gradient"}.union(*(owned(names, knob) for knob in SPREADS))
    assert changed(parts(one), parts(other)) == expected
    assert (other.seed, other.world) == other.surfaces.seed == (seed, world)


def test_streams_are_keyed_by_everything() -> None:
    keys = [(0, 0, -1, "a"), (1, 0, -1, "a"), (0, 1, -1, "a"), (0, 0, 0, "a"), (0, 0, -1, "b")]
    values = [stream(*key).standard_normal() for key in keys]
    assert len(set(values)) == len(keys)
    assert stream(*keys[0]).standard_normal() == values[0]


# ---- spreads, over many worlds -----------------------------------------------------------------


@pytest.fixture(scope="module")
def many(nominal: Nominal) -> list[dict[str, Array]]:
    return [parts(draw(nominal, EVERYTHING, 5, world)) for world in range(300)]


def deviations(
    nominal: Nominal, design: dict[str, Array], many: list[dict[str, Array]], name: str
) -> Array:
    """Deviations (worlds, N) from the design, in SI units: what the knob's sigma is that of."""
    start, found = design[name], np.array([m[name] for m in many])
    if name.endswith(".R"):
        return np.asarray(Rotation.from_matrix(start.T @ found).as_rotvec())
    if name.endswith(".f"):
        return np.asarray(found / start - 1)
    if name.startswith("print_"):
        boards = {"print_armtarget": nominal.armtarget, "print_tabletarget": nominal.tabletarget}
        side = nominal.marker.size
        return np.asarray((found - 1) * (boards[name].size if name in boards else (side, side)))
    if name == "light.colour":
        assert (found[:, 1] == 1).all()
        return np.asarray((found[:, [2]] - found[:, [0]]) * 5500)  # warmer is redder
    return np.asarray(found - start).reshape(len(many), -1)


def expected_mean(name: str) -> float:
    return sum(in_si(knob) for knob in SIGNED if matches(name, OWNED[knob].split()))


@pytest.mark.parametrize("knob", SPREADS)
def test_the_spread_is_the_stated_one(
    nominal: Nominal, design: dict[str, Array], many: list[dict[str, Array]], knob: str
) -> None:
    count = len(many)
    for name in owned(design, knob):
        errors = deviations(nominal, design, many, name) - expected_mean(name)
        sigmas = np.full(errors.shape[1], in_si(knob))
        if matches(name, ONLY_ABOUT_Z):
            sigmas[:2] = 0
        spread = np.sqrt((errors**2).mean(axis=0))
        assert (np.abs(errors.mean(axis=0)) <= 4 * sigmas / np.sqrt(count) + 1e-9).all(), name
        assert (np.abs(spread - sigmas) <= 4 * sigmas / np.sqrt(2 * count) + 1e-9).all(), name


def test_no_two_quantities_share_a_stream(
    nominal: Nominal, design: dict[str, Array], many: list[dict[str, Array]]
) -> None:
    columns = []
    for name in sorted({name for knob in SPREADS for name in owned(design, knob)}):
        found = deviations(nominal, design, many, name)
        moved = found[:, found.std(axis=0) > 1e-9]
        columns.append(moved[:, :1] if name.endswith(".f") else moved)
    correlations = np.corrcoef(np.hstack(columns), rowvar=False)
    # of independent draws: 0.06 each, and 0.26 the largest of them all
    assert np.abs(np.triu(correlations, 1)).max() < 0.35


def test_a_focal_length_scales_both_axes(
    design: dict[str, Array], many: list[dict[str, Array]]
) -> None:
    for m in many[:5]:
        scale = m["lens_hand.f"] / design["lens_hand.f"]
        assert scale[0] == scale[1]


def test_warmer_light_has_as_much_less_blue_as_more_red(many: list[dict[str, Array]]) -> None:
    for m in many:
        red, _, blue = m["light.colour"]
        assert red - 1 == pytest.approx(1 - blue, abs=1e-15)


def test_the_light_falls_by_the_stated_gradient_in_any_direction(
    many: list[dict[str, Array]],
) -> None:
    slopes = np.array([m["light.gradient"] for m in many])
    np.testing.assert_allclose(np.linalg.norm(slopes, axis=1), in_si("gradient_percent"))
    quadrants = np.unique(np.sign(slopes), axis=0, return_counts=True)[1]
    assert len(quadrants) == 4
    sigma = np.sqrt(len(many) * 0.25 * 0.75)
    assert (np.abs(quadrants - len(many) / 4) < 4 * sigma).all()


def test_the_largest_spreads_stay_physical(nominal: Nominal) -> None:
    largest = Tolerances(light_percent=50, exposure_percent=50, component_colour_percent=50)
    for world in range(200):
        as_built = draw(nominal, largest, 2, world)
        assert as_built.light.level >= 0.05
        assert min(sensor.brightness for sensor in as_built.sensors.values()) >= 0.05
        tones = as_built.surfaces.brightness.values()
        assert min(tones) >= 0.3
        assert max(tones) <= 2


# ---- frames ------------------------------------------------------------------------------------


def test_the_holders_bias_is_along_the_flanges_axes(nominal: Nominal) -> None:
    turned = replace(nominal, T_flange_camera=from_xyz_rpy([0, 0, 0.05], [0, 0, np.pi / 2]))
    bias = Tolerances(mount_bias_x_mm=9.0, mount_bias_z_mm=2.0)
    T = draw(turned, bias, 0).geometry.T_flange_camera
    np.testing.assert_allclose(T.translation, [0.009, 0, 0.052], atol=1e-15)
    np.testing.assert_array_equal(T.rotation, turned.T_flange_camera.rotation)


def off_the_table(T: SE3, design: SE3) -> tuple[bool, bool]:
    """Whether something is lifted off the table, and whether it is tilted on it."""
    lifted = abs(T.translation[2] - design.translation[2]) > 1e-12
    return lifted, bool(np.abs(T.rotation[:, 2] - [0, 0, 1]).max() > 1e-12)


@pytest.mark.parametrize("knob", KNOBS)
def test_hand_placed_things_stay_on_the_table(nominal: Nominal, knob: str) -> None:
    """Only the board's own stand lifts and tilts it."""
    geometry = draw(nominal, Tolerances.model_validate({knob: value(knob)}), 4).geometry
    board = off_the_table(geometry.T_base_board, nominal.T_base_board)
    assert board == (knob == "board_thickness_mm", knob == "board_tilt_deg")
    target = off_the_table(geometry.T_base_tabletarget, nominal.T_base_tabletarget)
    assert target == (False, False)


def test_all_knobs_together_leave_them_there_too(nominal: Nominal) -> None:
    flat = EVERYTHING.model_copy(update={"board_thickness_mm": 0.0, "board_tilt_deg": 0.0})
    geometry = draw(nominal, flat, 4).geometry
    for T, design in (
        (geometry.T_base_board, nominal.T_base_board),
        (geometry.T_base_tabletarget, nominal.T_base_tabletarget),
    ):
        assert off_the_table(T, design) == (False, False)


def test_the_board_tilts_about_its_own_axes_wherever_it_is_turned(nominal: Nominal) -> None:
    turned = replace(nominal, T_base_board=from_xyz_rpy([0.1, 0.5, 0.4], [0, 0, np.pi / 2]))
    only = Tolerances(board_tilt_deg=1.0, board_thickness_mm=1.0)
    straight = nominal.T_base_board.actInv(draw(nominal, only, 6).geometry.T_base_board)
    found = turned.T_base_board.actInv(draw(turned, only, 6).geometry.T_base_board)
    np.testing.assert_allclose(found.homogeneous, straight.homogeneous, atol=1e-12)
