"""Several markers told apart and solved for one pose: synthetic detections, known truth."""

import numpy as np
import pytest
from helpers.layouts import detections
from hypothesis import given
from hypothesis import strategies as st

from aoicell.errors import Refused, TargetNotFound
from aoicell.nominal import Nominal
from aoicell.registration import designed_layout
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.layout import Layout, LayoutConfig, LocatedLayout, identify, locate_layout
from aoicell.transforms import (
    SE3,
    Array,
    apply,
    distance_deg,
    distance_mm,
    from_rvec,
    from_xyz_rpy,
    translation,
)

IDS = ("M1", "M2", "M3", "M4")

seeds = st.integers(0, 2**32 - 1)
turns_deg = st.floats(-15, 15)


@pytest.fixture(scope="module")
def layout(nominal: Nominal) -> Layout:
    return designed_layout(nominal.board, CrossMarker())


def expected(nominal: Nominal) -> SE3:
    """T_camera_board of the overview."""
    return nominal.overview.T_target_camera.inverse()


def motion(nominal: Nominal, mm: float, direction: float, turn_deg: float) -> SE3:
    """T_board_displaced: a shift and a turn in the plane, about the positioning marker."""
    centre = nominal.T_board_positioning.translation
    shift = np.array([np.cos(direction), np.sin(direction), 0]) * mm / 1e3
    turn = from_rvec([0, 0, np.radians(turn_deg)], np.zeros(3))
    return translation(*(shift + centre)) * turn * translation(*-centre)


displacements = st.tuples(st.floats(0, 60), st.floats(0, 2 * np.pi), turns_deg)


def locate(
    nominal: Nominal, layout: Layout, found: list[Array], needed: int | None = None
) -> LocatedLayout:
    camera = nominal.cameras["hand"]
    return locate_layout(found, layout, camera, expected(nominal), needed)


def assert_same(found: dict[str, Array], layout: Layout, nominal: Nominal, T: SE3) -> None:
    """Every marker by its own name and in its right turn."""
    for id, uv in found.items():
        np.testing.assert_allclose(uv, nominal.cameras["hand"].project(layout[id], T), atol=1e-9)


@given(displacement=displacements, seed=seeds, missing=st.sampled_from((None, *IDS)))
def test_displaced_markers_keep_their_names(
    nominal: Nominal,
    layout: Layout,
    displacement: tuple[float, float, float],
    seed: int,
    missing: str | None,
) -> None:
    camera, rng = nominal.cameras["hand"], np.random.default_rng(seed)
    T = expected(nominal) * motion(nominal, *displacement)
    seen = detections(layout, camera, T, rng, without=[missing] if missing else [])
    found = identify(seen, layout, camera, expected(nominal))
    assert set(found) == set(IDS) - {missing}
    assert_same(found, layout, nominal, T)


@given(
    displacement=displacements,
    seed=seeds,
    missing=st.sampled_from((None, *IDS)),
    place=st.tuples(st.floats(-0.13, 0.13), st.floats(-0.07, 0.07), st.floats(-np.pi, np.pi)),
)
def test_a_false_square_is_left_out(
    nominal: Nominal,
    layout: Layout,
    displacement: tuple[float, float, float],
    seed: int,
    missing: str | None,
    place: tuple[float, float, float],
) -> None:
    camera, rng = nominal.cameras["hand"], np.random.default_rng(seed)
    T = expected(nominal) * motion(nominal, *displacement)
    x, y, turn = place
    false = camera.project(apply(from_xyz_rpy([x, y, 0], [0, 0, turn]), CrossMarker().crosses), T)
    seen = detections(layout, camera, T, rng, without=[missing] if missing else [])
    seen.insert(int(rng.integers(len(seen) + 1)), false)
    found = identify(seen, layout, camera, expected(nominal))
    assert set(found) == set(IDS) - {missing}
    assert_same(found, layout, nominal, T)


@pytest.mark.parametrize("quarter", range(4))
@given(displacement=displacements)
def test_one_marker_is_read_in_its_right_turn(
    nominal: Nominal, displacement: tuple[float, float, float], quarter: int
) -> None:
    layout, camera = {"M1": CrossMarker().crosses}, nominal.cameras["hand"]
    T_expected = nominal.check.T_target_camera.inverse()
    mm, direction, turn_deg = displacement
    shift = np.array([np.cos(direction), np.sin(direction), 0]) * mm / 1e3
    T = T_expected * from_rvec([0, 0, np.radians(turn_deg)], shift)
    uv = camera.project(layout["M1"], T)
    found = identify([np.roll(uv, quarter, axis=0)], layout, camera, T_expected)
    np.testing.assert_allclose(found["M1"], uv, atol=1e-9)


@pytest.mark.parametrize("turn_deg", [-47, -43, 43, 47])
def test_a_turn_that_could_be_another_quarter_is_refused(nominal: Nominal, turn_deg: float) -> None:
    layout, camera = {"M1": CrossMarker().crosses}, nominal.cameras["hand"]
    T_expected = nominal.check.T_target_camera.inverse()
    uv = camera.project(
        layout["M1"], T_expected * from_rvec([0, 0, np.radians(turn_deg)], np.zeros(3))
    )
    assert identify([uv], layout, camera, T_expected) == {}
    with pytest.raises(TargetNotFound, match=r"0 of 1 markers found, 1 needed \(missing: M1; 1 m"):
        locate_layout([uv], layout, camera, T_expected)


@pytest.mark.parametrize("turn_deg", [-38, 38])
def test_below_that_it_is_not(nominal: Nominal, layout: Layout, turn_deg: float) -> None:
    T = expected(nominal) * from_rvec([0, 0, np.radians(turn_deg)], np.zeros(3))
    seen = detections(layout, nominal.cameras["hand"], T, np.random.default_rng(0))
    assert distance_deg(locate(nominal, layout, seen).T_camera_target, T) < 1e-4


@pytest.mark.parametrize("turn_deg", [60, 90, 180, -90])
def test_a_board_turned_beyond_the_bound_is_refused(
    nominal: Nominal, layout: Layout, turn_deg: float
) -> None:
    T = expected(nominal) * from_rvec([0, 0, np.radians(turn_deg)], np.zeros(3))
    seen = detections(layout, nominal.cameras["hand"], T, np.random.default_rng(0))
    with pytest.raises(
        Refused, match=rf"turned by {abs(turn_deg)} deg .* at most 40 deg"
    ) as caught:
        locate(nominal, layout, seen)
    assert caught.value.cause == "too_far"


@pytest.mark.parametrize(
    ("moved", "told"),
    [
        (translation(0.16, 0, 0), "160 mm aside"),
        (translation(0, 0, 0.04), "40 mm out of its plane"),
        (from_rvec([np.radians(20), 0, 0], np.zeros(3)), "20 deg tilted"),
    ],
)
def test_a_board_beyond_the_stated_range_is_refused(
    nominal: Nominal, layout: Layout, rng: np.random.Generator, moved: SE3, told: str
) -> None:
    seen = detections(layout, nominal.cameras["hand"], expected(nominal) * moved, rng)
    with pytest.raises(Refused, match=told) as caught:
        locate(nominal, layout, seen)
    assert caught.value.cause == "too_far"


def test_a_second_board_within_the_range_makes_it_ambiguous(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    camera, T = nominal.cameras["hand"], expected(nominal)
    other = detections(layout, camera, T * translation(0.09, 0.05, 0), rng, without=["M1", "M2"])
    with pytest.raises(Refused, match="in the picture twice") as caught:
        locate(nominal, layout, [*detections(layout, camera, T, rng), *other])
    assert caught.value.cause == "ambiguous"


def test_a_second_board_beside_it_is_passed_over(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    camera, T = nominal.cameras["hand"], expected(nominal)
    other = detections(layout, camera, T * translation(0, 0.34, 0), rng)
    located = locate(nominal, layout, [*other, *detections(layout, camera, T, rng)])
    assert distance_mm(located.T_camera_target, T) < 1e-4


@given(displacement=displacements, seed=seeds)
def test_the_pose_is_exact(
    nominal: Nominal, layout: Layout, displacement: tuple[float, float, float], seed: int
) -> None:
    T = expected(nominal) * motion(nominal, *displacement)
    seen = detections(layout, nominal.cameras["hand"], T, np.random.default_rng(seed))
    located = locate(nominal, layout, seen)
    assert distance_mm(located.T_camera_target, T) < 1e-5
    assert distance_deg(located.T_camera_target, T) < 1e-5
    assert located.pose.rms_px < 1e-6
    assert set(located.uvs_px) == set(IDS)


@pytest.mark.parametrize("missing", [("M3",), ("M2", "M4"), ("M1", "M2", "M3"), IDS])
def test_missing_markers_are_named(
    nominal: Nominal, layout: Layout, rng: np.random.Generator, missing: tuple[str, ...]
) -> None:
    T = expected(nominal)
    seen = detections(layout, nominal.cameras["hand"], T, rng, without=missing)
    with pytest.raises(TargetNotFound) as caught:
        locate(nominal, layout, seen)
    text = str(caught.value)
    assert f"{4 - len(missing)} of 4 markers found, 4 needed" in text
    assert f"(missing: {', '.join(missing)}; {len(seen)} marker-like" in text
    assert "\n" not in text
    if len(missing) == 1:
        assert distance_mm(locate(nominal, layout, seen, needed=3).T_camera_target, T) < 1e-4


@pytest.mark.parametrize("moved", IDS)
def test_a_marker_that_was_moved_by_5_mm_is_noticed(
    nominal: Nominal, layout: Layout, rng: np.random.Generator, moved: str
) -> None:
    real = {**layout, moved: layout[moved] + [0.004, -0.003, 0]}
    seen = detections(real, nominal.cameras["hand"], expected(nominal), rng)
    with pytest.raises(
        Refused, match=r"fit their layout only to [\d.]+ px, at most 2\.0"
    ) as caught:
        locate(nominal, layout, seen)
    assert caught.value.cause == "inconsistent"


@pytest.mark.parametrize("moved", IDS)
@pytest.mark.parametrize("mm", [1.0, 7.0])
def test_one_marker_that_the_others_contradict_is_left_out(
    nominal: Nominal, layout: Layout, rng: np.random.Generator, moved: str, mm: float
) -> None:
    camera, T = nominal.cameras["hand"], expected(nominal)
    real = {**layout, moved: layout[moved] + [mm * 0.6e-3, -mm * 0.8e-3, 0]}
    seen = detections(real, camera, T, rng)
    located = locate_layout(seen, layout, camera, T, needed=3, sigma_px=0.01)
    assert located.left_out == (moved,)
    assert set(located.uvs_px) == set(IDS) - {moved}
    assert distance_mm(located.T_camera_target, T) < 1e-4


@given(mm=st.floats(0, 12), direction=st.floats(0, 2 * np.pi), moved=st.sampled_from(IDS))
def test_a_moved_marker_never_does_harm_unseen(
    nominal: Nominal, layout: Layout, mm: float, direction: float, moved: str
) -> None:
    camera, T = nominal.cameras["hand"], expected(nominal)
    step = [mm / 1e3 * np.cos(direction), mm / 1e3 * np.sin(direction), 0]
    seen = detections({**layout, moved: layout[moved] + step}, camera, T, np.random.default_rng(0))
    try:
        located = locate_layout(seen, layout, camera, T, needed=3, sigma_px=0.01)
    except Refused:
        return
    places = np.concatenate(list(layout.values()))
    off = apply(located.T_camera_target, places) - apply(T, places)
    assert np.linalg.norm(off[:, :2], axis=1).max() < 0.15e-3
    assert np.abs(off[:, 2]).max() < 0.6e-3  # along the line of sight it is seen worst


def test_of_two_that_could_be_left_out_it_is_the_one_that_tells_clearly(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    """A crumb over one corner of M3, and M2 a little off: without M2 the rest just fits, without M3
    far better.
    """
    camera, T, harmless = nominal.cameras["hand"], expected(nominal), LayoutConfig().harmless_px
    exact = identify(detections(layout, camera, T, rng), layout, camera, T)

    def noise(px: float, *without: str) -> float:
        left = [uv for id, uv in crumbed(px).items() if id not in without]
        return locate_layout(left, layout, camera, T, needed=3).noise_px

    def crumbed(px: float) -> dict[str, Array]:
        crumb = np.array([[0, 0], [0, 0], [0.45, 0.15], [0, 0]])
        return {
            **exact,
            "M3": exact["M3"] + px * crumb,
            "M2": exact["M2"] + px * np.array([-0.04, 0.15]),
        }

    px = 1.005 * harmless / noise(1.0)
    alone = {id: noise(px, id) for id in IDS}
    assert noise(px) > harmless
    assert sum(left < harmless for left in alone.values()) > 1
    assert alone["M3"] < 0.2 * harmless
    seen = list(crumbed(px).values())
    located = locate_layout(seen, layout, camera, T, needed=3, sigma_px=0.01)
    assert located.left_out == ("M3",)
    assert distance_mm(located.T_camera_target, T) < 0.2  # what M2 is off


def test_where_none_may_be_left_out_it_is_refused(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    camera, T = nominal.cameras["hand"], expected(nominal)
    real = {**layout, "M2": layout["M2"] + [0.0005, 0, 0]}
    seen = detections(real, camera, T, rng, without=["M4"])
    with pytest.raises(Refused, match="check for moved or false markers") as caught:
        locate_layout(seen, layout, camera, T, needed=3, sigma_px=0.01)
    assert caught.value.cause == "inconsistent"


def test_one_that_was_moved_further_is_named_as_missing(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    real = {**layout, "M3": layout["M3"] + [0.025, 0, 0]}
    seen = detections(real, nominal.cameras["hand"], expected(nominal), rng)
    with pytest.raises(TargetNotFound, match=r"missing: M3; 4 marker-like squares"):
        locate(nominal, layout, seen)


def test_the_accepted_fit_is_configured(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    camera = nominal.cameras["hand"]
    real = {**layout, "M2": layout["M2"] + [0.004, -0.003, 0]}
    seen = detections(real, camera, expected(nominal), rng)
    config = LayoutConfig(max_rms_px=20)
    located = locate_layout(seen, layout, camera, expected(nominal), config=config)
    assert 2 < located.pose.rms_px < 12
