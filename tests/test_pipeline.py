"""The procedure as a whole, in an exact cell and in the paper's."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.running import Rehearsal

from aoicell.benchmark.trial import Session, describe
from aoicell.calibration.poses import INTRINSIC_VIEWS, SETUP_MOTIONS, TABLE_2
from aoicell.errors import Refused, TargetNotFound
from aoicell.nominal import Nominal
from aoicell.observation import Observation
from aoicell.online import Looked, relocate
from aoicell.pipeline import METHODS, calibrate, flange_target, teach
from aoicell.transforms import distance_deg, distance_mm

pytest_plugins = ["helpers.sessions"]


def blank(picture: Observation) -> Observation:
    """The same state, and nothing to see."""
    return Observation(np.full_like(picture.grey, 90), picture.state, picture.camera)


def test_every_planned_picture_is_taken(ideal_rehearsal: Rehearsal) -> None:
    pictures = ideal_rehearsal.pictures
    assert len(pictures.tripod) == len(SETUP_MOTIONS)
    assert {p.camera for p in pictures.tripod} == {"tripod"}
    assert len(pictures.intrinsic) == len(INTRINSIC_VIEWS)
    assert len(pictures.table_2) == len(TABLE_2) == 6
    assert all(c.unused == () for c in ideal_rehearsal.session.calibrations.values())


def test_table_2_starts_at_a_and_moves_in_flange_axes(ideal_rehearsal: Rehearsal) -> None:
    states = [picture.state for picture in ideal_rehearsal.pictures.table_2]
    start = states[0].T_base_flange
    for state, dT in zip(states, TABLE_2.values(), strict=True):
        assert distance_mm(state.T_base_flange, start * dT) < 1e-4
        assert distance_deg(state.T_base_flange, start * dT) < 1e-4


@pytest.mark.parametrize("method", ["paper", "aoicell_one_look", "aoicell", "markerless"])
def test_an_exact_cell_is_found_to_be_so(ideal_session: Session, method: str) -> None:
    nominal, found = ideal_session.nominal, ideal_session.calibrations[method]
    for name, intrinsics in (("hand", found.hand), ("tripod", found.tripod)):
        assert intrinsics.camera.focal_px == pytest.approx(
            nominal.cameras[name].focal_px,  # type: ignore[index]
            rel=2e-3,
        )
        assert intrinsics.rms_px < 0.05
    assert distance_mm(found.world.T_base_tabletarget, nominal.T_base_tabletarget) < 2
    assert distance_mm(found.hand_eye.T_flange_camera, nominal.T_flange_camera) < 1
    assert distance_deg(found.hand_eye.T_flange_camera, nominal.T_flange_camera) < 0.1
    assert distance_mm(found.hand_eye.T_base_target, nominal.T_base_tabletarget) < 0.5


def test_the_methods_differ_as_they_say(ideal_session: Session) -> None:
    paper, ours = (ideal_session.calibrations[name] for name in ("paper", "aoicell"))
    assert paper.world.views == 1
    assert paper.world.T_flange_armtarget == ideal_session.nominal.T_flange_armtarget
    assert paper.hand_eye.views == 6
    assert paper.arm is ideal_session.nominal.arm
    assert ours.world.views == len(SETUP_MOTIONS)
    assert ours.hand_eye.views == len(INTRINSIC_VIEWS) + 6
    assert ours.arm is not ideal_session.nominal.arm
    templates = ideal_session.templates
    assert list(templates["paper"].layout) == ["M1"]
    assert templates["paper"].look is ideal_session.taught.check
    assert set(templates["aoicell"].layout) == {"M1", "M2", "M3", "M4"}
    assert templates["aoicell"].look is ideal_session.taught.overview


def test_the_papers_holder_is_measured_as_in_its_table_3(paper_session: Session) -> None:
    record = describe(paper_session)
    by_method = {h.method: h for h in record.hand_eyes}
    for method in ("paper", "aoicell"):
        hand_eye = by_method[method]
        np.testing.assert_allclose(hand_eye.true_offset_mm, [9, 0, 2], atol=2)
        gap = np.subtract(hand_eye.design_mm, hand_eye.true_offset_mm)
        assert np.linalg.norm(gap) == pytest.approx(hand_eye.error_mm, abs=1e-9)
        assert hand_eye.error_mm < 6
        assert 0 < hand_eye.error_deg < 0.5
    assert by_method["aoicell"].error_mm < by_method["paper"].error_mm
    assert record.arm_floor_mm > 0


def test_a_picture_without_the_board_is_left_out_and_named(ideal_rehearsal: Rehearsal) -> None:
    pictures = ideal_rehearsal.pictures
    spoilt = list(pictures.intrinsic)
    spoilt[2] = blank(spoilt[2])
    result = calibrate(
        replace(pictures, intrinsic=tuple(spoilt)),
        ideal_rehearsal.session.nominal,
        [METHODS["paper"]],
    )["paper"]
    (reason,) = result.unused
    assert reason.startswith("hand picture 3: no chessboard of 8x6 inner corners")
    before = ideal_rehearsal.session.calibrations["paper"]
    assert distance_mm(result.hand_eye.T_flange_camera, before.hand_eye.T_flange_camera) < 0.5


def test_too_few_pictures_refuse_the_calibration(ideal_rehearsal: Rehearsal) -> None:
    pictures = ideal_rehearsal.pictures
    few = replace(pictures, tripod=pictures.tripod[:6], intrinsic=(), table_2=pictures.table_2[:3])
    with pytest.raises(Refused, match="intrinsics: 3 views show the chessboard; take at least 6"):
        calibrate(few, ideal_rehearsal.session.nominal, [METHODS["paper"]])


@pytest.mark.parametrize(
    "method",
    [
        "paper",
        "aoicell",
    ],
)
def test_teaching_without_the_board_is_refused(ideal_session: Session, method: str) -> None:
    taught = ideal_session.taught
    nothing = replace(
        taught,
        check=blank(taught.check),
        overview=blank(taught.overview),
        views=tuple(replace(v, standard=blank(v.standard)) for v in taught.views),
    )
    with pytest.raises(TargetNotFound, match="missing: M1"):
        teach(nothing, ideal_session.calibrations[method], ideal_session.nominal, METHODS[method])


@pytest.mark.parametrize("method", ["paper", "aoicell_one_look", "aoicell"])
def test_looking_at_nothing_is_refused(ideal_session: Session, method: str) -> None:
    online = ideal_session.online(method)
    with pytest.raises(TargetNotFound, match=r"missing: M1.*bring the board back into view"):
        relocate(Looked(blank(online.template.look)), online)


def test_a_view_is_commanded_by_the_design(nominal: Nominal) -> None:
    q = flange_target(nominal, nominal.T_base_board, nominal.overview, nominal.q_home)
    seen = (nominal.arm.fk(q) * nominal.T_flange_camera).actInv(nominal.T_base_board)
    assert distance_mm(seen, nominal.overview.T_target_camera.inverse()) < 1e-4
    assert seen.translation[2] == pytest.approx(1.15, abs=1e-6)
