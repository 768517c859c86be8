"""Views and boards as a whole: good ones pass, bad ones fail, without sight there is no verdict."""

import numpy as np
import pytest

from aoicell.errors import InputError
from aoicell.inspection import (
    BoardInspection,
    Finding,
    ForeignObject,
    Reference,
    ViewInspection,
    inspect_board,
    inspect_view,
)
from aoicell.inspection.inspect import together
from aoicell.nominal import Nominal
from aoicell.transforms import rotation, translation
from inspection.flat_boards import T_CAMERA_BOARD, Flat, painted, photograph
from inspection.scenes import (
    DEFECTS,
    TOLERATED,
    Look,
    Scene,
    called,
    gives_no_verdict,
    is_finite,
)

# ---- good boards -------------------------------------------------------------------------------


def test_another_picture_of_the_same_board_passes(flat: Flat) -> None:
    new = photograph(flat.plane, T_CAMERA_BOARD * translation(5e-4), seed=1)
    inspection = inspect_board({"flat": new}, {"flat": flat.reference}, flat.board)
    assert inspection.verdict == "pass"
    assert set(inspection.components) == {c.id for c in flat.board.components}
    for finding in inspection.components.values():
        assert finding.state == "present"
        assert np.hypot(*finding.shift) < 0.03e-3
        assert abs(finding.rotation) < np.radians(0.3)
        assert finding.confidence > 0.9
        assert finding.view == "flat"
    assert inspection.foreign == ()
    assert inspection.hidden == ()


def test_the_very_same_picture_passes(flat: Flat) -> None:
    image = flat.reference.images[0]
    inspection = inspect_view(image, flat.reference, flat.board)
    assert is_finite(inspection)
    assert called(inspection) == []
    assert all(np.hypot(*f.shift) < 1e-6 for f in inspection.findings.values())


def test_no_picture_and_no_reference_is_changed(flat: Flat) -> None:
    new = photograph(flat.plane, seed=2)
    before = new.copy(), flat.reference.images[0].copy()
    first, again = (inspect_view(new, flat.reference, flat.board) for _ in range(2))
    np.testing.assert_array_equal(new, before[0])
    np.testing.assert_array_equal(flat.reference.images[0], before[1])
    assert first.findings == again.findings


@pytest.mark.parametrize("light", [0.8, 1.2])
def test_light_is_no_defect(flat: Flat, light: float) -> None:
    inspection = inspect_view(
        photograph(flat.plane, seed=3, light=light), flat.reference, flat.board
    )
    assert inspection.registration.state == "registered"
    assert called(inspection) == []
    assert is_finite(inspection)


def test_a_darker_cell_is_no_defect_on_most_parts(
    scene: Scene, taught: Look, reference: Reference, nominal: Nominal
) -> None:
    dark = scene.look("V3", light=0.8)
    assert dark.grey.mean() < 0.9 * taught.grey.mean()
    inspection = inspect_view(dark.grey, reference, nominal.board)
    assert inspection.registration.state == "registered"
    assert len(inspection.findings) > 50
    assert len(called(inspection)) <= 0.05 * len(inspection.findings)
    assert is_finite(inspection)


def test_another_good_board_has_few_false_calls(
    golden: Look, reference: Reference, nominal: Nominal
) -> None:
    inspection = inspect_view(golden.grey, reference, nominal.board)
    assert len(inspection.findings) > 50
    assert len(called(inspection)) <= 0.06 * len(inspection.findings)
    assert len(inspection.foreign) <= 2
    assert is_finite(inspection)


# ---- bad boards --------------------------------------------------------------------------------


def test_a_bad_board_fails(spoilt: Look, reference: Reference, nominal: Nominal) -> None:
    inspection = inspect_board({"V3": spoilt.grey}, {"V3": reference}, nominal.board)
    assert inspection.verdict == "fail"
    assert inspection.registrations["V3"].state == "registered"
    assert set(inspection.hidden) | set(inspection.components) == {
        c.id for c in nominal.board.components
    }
    assert not set(inspection.hidden) & set(inspection.components)
    assert {"CPU1", "J1"} <= set(inspection.hidden), "under its cooler, and far out of the picture"


def test_defects_are_called_and_others_are_not(inspected: ViewInspection) -> None:
    wrong = {d.component for d in DEFECTS if d.kind != "foreign_object"} - set(TOLERATED)
    assert wrong <= set(called(inspected))
    false = set(called(inspected)) - wrong
    assert len(false) <= 0.06 * len(inspected.findings), false


def test_a_component_is_boxed_where_it_is(
    inspected: ViewInspection, taught: Look, nominal: Nominal
) -> None:
    """In the reference's pixels."""
    for id, finding in inspected.findings.items():
        if finding.visible < 0.95:
            continue
        c = nominal.board.component(id)
        [[u, v]] = taught.camera.project([[c.x, c.y, c.top]], taught.T_camera_board)
        left, top, right, bottom = finding.area_px
        assert left - 3 <= u <= right + 3, id
        assert top - 3 <= v <= bottom + 3, id


# ---- no verdict --------------------------------------------------------------------------------


def test_a_black_picture_gets_no_verdict(reference: Reference, nominal: Nominal) -> None:
    black = np.zeros_like(reference.images[0])
    assert gives_no_verdict(inspect_view(black, reference, nominal.board))
    board = inspect_board({"V3": black}, {"V3": reference}, nominal.board)
    assert board.verdict == "no_verdict"
    assert {f.state for f in board.components.values()} == {"no_verdict"}


def test_a_picture_of_another_place_gets_no_verdict(
    scene: Scene, taught: Look, reference: Reference, nominal: Nominal
) -> None:
    elsewhere = scene.look("V2")
    assert gives_no_verdict(inspect_view(elsewhere.grey, reference, nominal.board))


@pytest.mark.parametrize("turn_deg", [180, 90, 8])
def test_a_turned_board_gets_no_verdict(flat: Flat, turn_deg: float) -> None:
    T = T_CAMERA_BOARD * rotation("z", np.radians(turn_deg))
    assert gives_no_verdict(inspect_view(photograph(flat.plane, T), flat.reference, flat.board))


def test_a_turned_server_board_gets_no_verdict(
    scene: Scene, taught: Look, reference: Reference, nominal: Nominal
) -> None:
    T = scene.world.T_base_board * rotation("z", np.pi)
    turned = scene.look("V3", T_base_board=T)
    assert gives_no_verdict(inspect_view(turned.grey, reference, nominal.board))


def test_what_leaves_the_picture_gets_no_verdict(flat: Flat) -> None:
    """Half of the new picture was never taken: no part there is called anything else."""
    half = photograph(flat.plane, seed=4)
    half[:, :400] = 0
    inspection = inspect_view(half, flat.reference, flat.board)
    assert is_finite(inspection)
    for id, finding in inspection.findings.items():
        left, _, _, _ = finding.area_px
        if left > 420:
            assert finding.state in ("present", "no_verdict"), id
        elif finding.area_px[2] < 380:
            assert finding.state != "present", id


def test_a_view_without_reference_is_named(flat: Flat) -> None:
    image = flat.reference.images[0]
    with pytest.raises(InputError, match=r"view flt: there is no reference of it.*flat"):
        inspect_board({"flt": image}, {"flat": flat.reference}, flat.board)


def test_nothing_to_look_at_gets_no_verdict(flat: Flat) -> None:
    inspection = inspect_board({}, {"flat": flat.reference}, flat.board)
    assert inspection.verdict == "no_verdict"
    assert len(inspection.hidden) == len(flat.board.components)


# ---- several views -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def good_view(flat: Flat) -> ViewInspection:
    return inspect_view(photograph(flat.plane, seed=5), flat.reference, flat.board)


def _board(flat: Flat, good: ViewInspection, *findings: Finding) -> BoardInspection:
    """The good view together with another that has only some findings."""
    other = ViewInspection("other", good.registration, {f.component: f for f in findings})
    return together([good, other], flat.board)


def test_the_view_that_shows_most_decides(flat: Flat, good_view: ViewInspection) -> None:
    own = good_view.findings["U4"].visible
    less = Finding("U4", "absent", visible=own - 0.1, view="other")
    more = Finding("U4", "absent", visible=own + 0.1, view="other")
    assert _board(flat, good_view, less).components["U4"].view == "flat"
    assert _board(flat, good_view, less).verdict == "pass"
    assert _board(flat, good_view, more).components["U4"].view == "other"
    assert _board(flat, good_view, more).verdict == "fail"


def test_a_verdict_comes_before_none(flat: Flat, good_view: ViewInspection) -> None:
    unseen = Finding("U4", "no_verdict", visible=1.1, view="other")
    board = _board(flat, good_view, unseen)
    assert board.components["U4"].state == "present"
    assert board.verdict == "pass"


def test_one_that_could_not_be_judged_spoils_a_pass_but_no_fail(
    flat: Flat, good_view: ViewInspection
) -> None:
    findings = {id: f for id, f in good_view.findings.items() if id != "U4"}
    findings["U4"] = Finding("U4", "no_verdict")
    view = ViewInspection("flat", good_view.registration, findings)
    assert together([view], flat.board).verdict == "no_verdict"
    findings["U5"] = Finding("U5", "absent")
    assert together([view], flat.board).verdict == "fail"


def test_an_object_that_two_views_see_is_one(flat: Flat, good_view: ViewInspection) -> None:
    def spot(x: float, y: float, confidence: float) -> ForeignObject:
        return ForeignObject((x, y), 1e-3, confidence, "flat", (0, 0, 9, 9))

    views = [
        ViewInspection(f"{n}", good_view.registration, good_view.findings, spots)
        for n, spots in enumerate([(spot(0.02, 0.01, 0.8),),
                                   (spot(0.0205, 0.01, 0.9), spot(0.05, 0.01, 0.7))])
    ]  # fmt: skip
    board = together(views, flat.board)
    assert board.verdict == "fail"
    assert [f.confidence for f in board.foreign] == [0.9, 0.7]


def test_a_view_from_nowhere_leaves_what_others_found(flat: Flat) -> None:
    """One blind camera, one that sees a missing part: the board fails, with the part named."""
    other = Reference("blind", flat.reference.images, T_CAMERA_BOARD, flat.reference.camera)
    images = {
        "blind": np.zeros_like(flat.reference.images[0]),
        "flat": photograph(painted(flat.board, missing=("U2",)), seed=6),
    }
    board = inspect_board(images, {"flat": flat.reference, "blind": other}, flat.board)
    assert board.registrations["blind"].state == "no_verdict"
    assert board.verdict == "fail"
    assert [id for id, f in board.components.items() if f.is_defect] == ["U2"]
