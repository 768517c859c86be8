"""The online phase with coded markers: a board in any turn, by the detector's sightings."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

from aoicell.benchmark.trial import Session, prepare
from aoicell.camera import Camera
from aoicell.localization import localize
from aoicell.nominal import Nominal
from aoicell.observation import Observation
from aoicell.online import look, relocate
from aoicell.registration import Template
from aoicell.scenario import Scenario
from aoicell.targets.layout import LocatedLayout
from aoicell.transforms import SE3, Array, distance_deg, distance_mm, from_rvec


@pytest.fixture(scope="module", params=["coded", "charuco"])
def coded(nominal: Nominal, request: pytest.FixtureRequest) -> Iterator[Session]:
    scenario = Scenario(
        name="turned", profile="ideal", pictures=False, methods=["aoicell_one_look", "paper"],
        marker={"kind": request.param},  # type: ignore[arg-type]
    )  # fmt: skip
    session = prepare(scenario, scenario.fitted(nominal), 0)
    yield session
    session.world.close()


def turned(session: Session, deg: float, id: str = "") -> SE3:
    """The board turned about its middle, or about a marker: T_base_motion."""
    T_taught = session.T_base_board_taught
    T = T_taught * session.world.geometry.Ts_board_marker[id] if id else T_taught
    about = SE3(np.eye(3), T.translation)
    motion = about * from_rvec([0, 0, np.radians(deg)], np.zeros(3)) * about.inverse()
    session.world.place_board(motion * T_taught)
    return motion


@pytest.mark.parametrize("deg", [60, -60])
def test_a_turned_board_is_found_and_its_views_corrected(coded: Session, deg: float) -> None:
    online = coded.online("aoicell_one_look")
    motion = turned(coded, deg)
    correction = relocate(look(coded.cell, online), online)
    assert distance_mm(correction.T_base_motion, motion) < 0.2
    assert distance_deg(correction.T_base_motion, motion) < 0.01
    assert correction.views


@pytest.mark.parametrize("deg", [100, 180])
def test_it_is_located_in_any_turn(coded: Session, deg: float) -> None:
    """Whether the arm gets to the views is another question."""
    online = coded.online("aoicell_one_look")
    taught = online.template.taught.T_camera_target
    turned(coded, deg)
    looked = look(coded.cell, online)
    T_base_camera = coded.world.truth_of(looked.board).T_base_camera
    T_before = T_base_camera.actInv(coded.T_base_board_taught)
    T_now = T_base_camera.actInv(coded.world.T_base_board)
    located = online.locate(looked.board)
    expected = taught * T_before.inverse() * T_now
    assert distance_mm(located.T_camera_target, expected) < 0.1
    assert distance_deg(located.T_camera_target, expected) < 0.01


def test_the_papers_one_marker_is_read_in_its_turn(coded: Session) -> None:
    motion, online = turned(coded, 70, "M1"), coded.online("paper")
    correction = relocate(look(coded.cell, online), online)
    assert distance_deg(correction.T_base_motion, motion) < 0.2


def test_a_localiser_of_ones_own_is_given_points(coded: Session) -> None:
    given: list[Array] = []

    def mine(
        observation: Observation, detections: Sequence[Array], template: Template, camera: Camera
    ) -> LocatedLayout:
        given.extend(detections)
        return localize(observation, detections, template, camera)

    online = coded.online("aoicell_one_look")
    turned(coded, 10)
    looked = look(coded.cell, online)
    ours = online.locate(looked.board)
    theirs = replace(online, method=replace(online.method, localize=mine)).locate(looked.board)
    assert [uv.shape for uv in given] == [(4, 2)] * 4
    assert distance_mm(ours.T_camera_target, theirs.T_camera_target) < 1e-9
