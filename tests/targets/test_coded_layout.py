"""Markers with codes: found by what they say, whichever way the board lies; known truth."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from helpers.layouts import detections
from helpers.marked import shown
from helpers.printed import BENT, seen_from
from hypothesis import given
from hypothesis import strategies as st

from aoicell.errors import Refused, TargetNotFound
from aoicell.nominal import Nominal
from aoicell.registration import designed_layout
from aoicell.targets.coded_layout import Codes
from aoicell.targets.layout import Layout, LocatedLayout, identify, locate_layout
from aoicell.targets.marker import make_marker, sight_markers
from aoicell.targets.marker_sighting import Detection, MarkerSighting
from aoicell.transforms import (
    SE3,
    distance_deg,
    distance_mm,
    from_rvec,
    from_xyz_rpy,
    translation,
)

IDS = ("M1", "M2", "M3", "M4")
UNIQUE = dict(zip(IDS, "0123", strict=True))
REPEATED = dict(zip(IDS, "1231", strict=True))  # as coded crosses have it

seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def layout(nominal: Nominal) -> Layout:
    return designed_layout(nominal.board, nominal.marker)


def expected(nominal: Nominal) -> SE3:
    """T_camera_board of the overview."""
    return nominal.overview.T_target_camera.inverse()


def turned_by(deg: float, x: float = 0.0, y: float = 0.0) -> SE3:
    """T_board_displaced, about the board's middle (m)."""
    return from_xyz_rpy([x, y, 0], [0, 0, np.radians(deg)])


def sighted(
    nominal: Nominal,
    layout: Layout,
    codes: Mapping[str, str],
    T_camera_board: SE3,
    rng: np.random.Generator | None = None,
    without: Iterable[str] = (),
) -> list[MarkerSighting]:
    """The markers as a detector gives them: in any order, from the print's top left on."""
    camera = nominal.cameras["hand"]
    seen = [
        MarkerSighting(camera.project(points, T_camera_board), np.full(4, 0.05), codes[id])
        for id, points in layout.items()
        if id not in without
    ]
    return seen if rng is None else [seen[k] for k in rng.permutation(len(seen))]


def locate(
    nominal: Nominal, layout: Layout, codes: Codes, seen: list[MarkerSighting], needed: int = 3
) -> LocatedLayout:
    camera = nominal.cameras["hand"]
    return locate_layout(seen, layout, camera, expected(nominal), needed, codes=codes)


# -- Any way round ----------------------------------------------------------------------------


@pytest.mark.parametrize("codes", [UNIQUE, REPEATED])
@given(
    turn_deg=st.floats(-180, 180),
    place=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
    seed=seeds,
    missing=st.sampled_from((None, *IDS)),
)
def test_any_turn_and_shift_is_located(
    nominal: Nominal,
    layout: Layout,
    codes: dict[str, str],
    turn_deg: float,
    place: tuple[float, float],
    seed: int,
    missing: str | None,
) -> None:
    T = expected(nominal) * turned_by(turn_deg, *place)
    rng, without = np.random.default_rng(seed), [missing] if missing else []
    located = locate(nominal, layout, codes, sighted(nominal, layout, codes, T, rng, without))
    assert distance_mm(located.T_camera_target, T) < 1e-4
    assert distance_deg(located.T_camera_target, T) < 1e-4
    assert set(located.uvs_px) == set(IDS) - {missing}


@pytest.mark.parametrize("turn_deg", [0, 100, 180, -90])
@pytest.mark.parametrize("kind", ["coded", "apriltag", "charuco"])
def test_pictures_of_a_turned_board_are_located(
    nominal: Nominal, kind: str, turn_deg: float
) -> None:
    changed = nominal.with_markers(kind)
    marks = [replace(m, x=m.x / 2, y=m.y / 2) for m in changed.board.markers]  # all in one view
    layout = designed_layout(replace(changed.board, markers=tuple(marks)), changed.marker)
    T_expected = seen_from(tilt=(0.1, -0.15), distance=0.6)
    T = T_expected * turned_by(turn_deg, 0.004, -0.003)
    prints = [
        (
            make_marker(kind, m.size, m.pitch, m.code),
            T * from_xyz_rpy([m.x, m.y, m.z], [0, 0, m.rotation]),
        )
        for m in marks
    ]
    seen = sight_markers(changed.marker, shown(*prints, noise=0.5), BENT)
    located = locate_layout(seen, layout, BENT, T_expected, codes=changed.marker_codes)
    assert set(located.uvs_px) == set(IDS)
    assert distance_mm(located.T_camera_target, T) < 0.25
    assert distance_deg(located.T_camera_target, T) < 0.05


@pytest.mark.parametrize("turn_deg", [80, 100, 180])
def test_what_plain_markers_do_not_tell_is_refused(
    nominal: Nominal, layout: Layout, rng: np.random.Generator, turn_deg: float
) -> None:
    camera, T_expected = nominal.cameras["hand"], expected(nominal)
    T = T_expected * turned_by(turn_deg)
    with pytest.raises(Refused, match=rf"turned by {turn_deg:.0f} deg .* at most 40 deg") as caught:
        locate_layout(detections(layout, camera, T, rng), layout, camera, T_expected, 3)
    assert caught.value.cause == "too_far"
    with pytest.raises(Refused, match=rf"turned by {turn_deg:.0f} deg"):  # codes that nobody asked
        locate_layout(sighted(nominal, layout, UNIQUE, T), layout, camera, T_expected, 3)
    seen = sighted(nominal, layout, UNIQUE, T)
    assert distance_mm(locate(nominal, layout, UNIQUE, seen).T_camera_target, T) < 1e-4


def test_one_marker_tells_its_turn(nominal: Nominal, layout: Layout) -> None:
    camera, alone = nominal.cameras["hand"], {"M1": layout["M1"]}
    T = expected(nominal) * turned_by(135)
    seen = sighted(nominal, alone, REPEATED, T)
    located = locate_layout(seen, alone, camera, expected(nominal) * turned_by(120), codes=REPEATED)
    assert distance_deg(located.T_camera_target, T) < 1e-3


# -- Codes that are not to be trusted ----------------------------------------------------------


def test_a_foreign_code_is_no_marker_of_the_board(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    T = expected(nominal) * turned_by(100)
    seen = sighted(nominal, layout, UNIQUE, T, rng, without=["M3"])
    lies = sighted(nominal, layout, dict.fromkeys(IDS, "17"), T, without=["M1", "M2", "M4"])
    located = locate(nominal, layout, UNIQUE, [*lies, *seen])  # where M3 belongs
    assert set(located.uvs_px) == {"M1", "M2", "M4"}
    assert distance_mm(located.T_camera_target, T) < 1e-4


def test_foreign_codes_alone_are_refused(nominal: Nominal, layout: Layout) -> None:
    other = dict(zip(IDS, ("10", "11", "12", "9"), strict=True))
    seen = sighted(nominal, layout, other, expected(nominal))
    with pytest.raises(TargetNotFound) as caught:
        locate(nominal, layout, UNIQUE, seen)
    assert "0 of 4 markers found by their codes, 3 needed" in str(caught.value)
    assert "not on the board: code 9, 10, 11, 12)" in str(caught.value)
    assert caught.value.cause == "marker_not_found"


def test_points_without_a_code_are_no_coded_markers(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    camera, T = nominal.cameras["hand"], expected(nominal)
    found: list[Detection] = list(detections(layout, camera, T, rng))
    with pytest.raises(TargetNotFound, match="not on the board: code none"):
        locate_layout(found, layout, camera, T, codes=UNIQUE)


def test_a_code_seen_twice_is_not_trusted(
    nominal: Nominal, layout: Layout, rng: np.random.Generator
) -> None:
    T = expected(nominal) * turned_by(-100)
    stray = sighted(nominal, layout, UNIQUE, T * translation(0.1, 0.05, 0), without=IDS[1:])
    seen = sighted(nominal, layout, UNIQUE, T, rng)
    located = locate(nominal, layout, UNIQUE, [*stray, *seen])
    assert set(located.uvs_px) == {"M2", "M3", "M4"}
    assert distance_mm(located.T_camera_target, T) < 1e-4
    with pytest.raises(Refused, match=r"missing: M1 \(code 0\); more often .*: code 0\)") as caught:
        locate(nominal, layout, UNIQUE, [*stray, *seen], needed=4)
    assert caught.value.cause == "ambiguous"


@pytest.mark.parametrize("codes", [UNIQUE, REPEATED])
def test_two_boards_are_ambiguous(nominal: Nominal, layout: Layout, codes: dict[str, str]) -> None:
    T = expected(nominal)
    seen = sighted(nominal, layout, codes, T)
    beside = sighted(nominal, layout, codes, T * turned_by(170, 0, 0.34))
    with pytest.raises(Refused, match="more often than on the board") as caught:
        locate(nominal, layout, codes, [*seen, *beside])
    assert caught.value.cause == "ambiguous"


def test_parts_of_two_boards_are_ambiguous(nominal: Nominal, layout: Layout) -> None:
    eight = {**layout, **{f"N{id}": points + [0.1, 0.03, 0] for id, points in layout.items()}}
    codes = {id: str(k) for k, id in enumerate(eight)}
    T = expected(nominal)
    seen = sighted(nominal, eight, codes, T, without=["NM3", "NM4"])
    other = sighted(nominal, eight, codes, T * turned_by(90, 0.6), without=[*IDS, "NM1", "NM2"])
    with pytest.raises(Refused, match="NM3, NM4 are in the picture as of another board") as caught:
        locate(nominal, eight, codes, [*seen, *other])
    assert caught.value.cause == "ambiguous"


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda seen: replace(seen, uv_px=np.roll(seen.uv_px, 1, axis=0)), "missing: M2"),
        (lambda seen: replace(seen, uv_px=seen.uv_px + 60), "missing: M2"),
    ],
    ids=["turned", "moved"],
)
def test_a_marker_that_lies_wrong_is_left_out(
    nominal: Nominal,
    layout: Layout,
    spoil: Callable[[MarkerSighting], MarkerSighting],
    told: str,
) -> None:
    T = expected(nominal) * turned_by(50)
    seen = sighted(nominal, layout, UNIQUE, T)
    seen[1] = spoil(seen[1])
    located = locate(nominal, layout, UNIQUE, seen)
    assert set(located.uvs_px) == {"M1", "M3", "M4"}
    assert distance_mm(located.T_camera_target, T) < 1e-4
    with pytest.raises(TargetNotFound, match=told):
        locate(nominal, layout, UNIQUE, seen, needed=4)


def test_exchanged_markers_are_not_believed(nominal: Nominal, layout: Layout) -> None:
    exchanged = {**UNIQUE, "M2": UNIQUE["M3"], "M3": UNIQUE["M2"]}
    seen = sighted(nominal, layout, exchanged, expected(nominal))
    with pytest.raises(TargetNotFound, match=r"2 of 4 .* \(missing: M2 \(code 1\), M3 \(code 2\)"):
        locate(nominal, layout, UNIQUE, seen)


# -- The range that is left --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("moved", "told"),
    [
        (translation(0, 0, 0.04), "40 mm out of its plane and 0 deg tilted"),
        (from_rvec([np.radians(20), 0, 0], np.zeros(3)), "20 deg tilted"),
    ],
)
def test_a_board_that_lies_on_nothing_is_refused(
    nominal: Nominal, layout: Layout, moved: SE3, told: str
) -> None:
    T = expected(nominal) * turned_by(120, 0.2) * moved
    with pytest.raises(Refused, match=told) as caught:
        locate(nominal, layout, UNIQUE, sighted(nominal, layout, UNIQUE, T))
    assert caught.value.cause == "too_far"
    assert "at most 30 mm out of its plane and 15 deg are accepted" in str(caught.value)


def test_repeated_codes_alone_keep_the_range_of_shifts(nominal: Nominal, layout: Layout) -> None:
    for x, within in ((0.1, True), (0.2, False)):
        T = expected(nominal) * translation(x, 0, 0)
        seen = sighted(nominal, layout, REPEATED, T, without=["M2", "M3"])
        if within:
            located = locate(nominal, layout, REPEATED, seen, needed=2)
            assert distance_mm(located.T_camera_target, T) < 1e-3
            continue
        with pytest.raises(Refused, match=r"200 mm aside.* at most 150 mm"):
            locate(nominal, layout, REPEATED, seen, needed=2)


def test_one_of_two_with_the_same_code_is_either(nominal: Nominal, layout: Layout) -> None:
    seen = sighted(nominal, layout, REPEATED, expected(nominal), without=["M1", "M2", "M3"])
    with pytest.raises(Refused, match="as of another board") as caught:
        locate(nominal, layout, REPEATED, seen, needed=1)
    assert caught.value.cause == "ambiguous"


@pytest.mark.parametrize("id", ["M1", "M4"])
def test_when_taught_it_is_the_one_that_is_nearer(
    nominal: Nominal, layout: Layout, id: str
) -> None:
    camera, T = nominal.cameras["hand"], expected(nominal)
    seen = sighted(nominal, {id: layout[id]}, REPEATED, T)
    found = identify(seen, layout, camera, T * turned_by(5, 0.01), codes=REPEATED)
    assert list(found) == [id]
