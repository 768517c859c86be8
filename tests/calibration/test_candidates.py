"""Calibration poses are usable in the cell as built, by MuJoCo's own account of contacts."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.calibration.candidates import (
    CandidateConfig,
    candidates,
    collision_model,
    free_path,
    hand_eye_start,
)
from aoicell.calibration.planning import inspection_work
from aoicell.calibration.poses import TABLE_2
from aoicell.errors import Unreachable
from aoicell.nominal import Nominal
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World
from aoicell.transforms import Array


@pytest.fixture(scope="module")
def drawn(nominal: Nominal) -> list[Array]:
    return candidates(nominal, 60, np.random.default_rng(0), CandidateConfig())


def test_the_board_is_seen_and_nothing_touches_in_cells_as_built(
    nominal: Nominal, drawn: list[Array]
) -> None:
    for seed in range(2):
        world = World(nominal, draw(nominal, TYPICAL, seed), pictures=False)
        for q in drawn:
            world.arrive(q)
            truth = world.truth()
            T = truth.T_base_camera.actInv(world.geometry.T_base_tabletarget)
            assert truth.camera.sees(world.board_points("tabletarget"), T, margin_px=5)
            assert not world.contacts()


def test_they_keep_off_limits_and_other_branches(nominal: Nominal, drawn: list[Array]) -> None:
    config = CandidateConfig()
    for q in drawn:
        assert nominal.arm.limit_margin(q) >= np.radians(config.limit_deg)
        assert nominal.arm.singularity_margin(q) >= config.singularity
        assert np.sign(q[4]) == np.sign(nominal.q_home[4])


def test_they_spread_over_what_is_allowed(nominal: Nominal, drawn: list[Array]) -> None:
    T_target_base = nominal.T_base_tabletarget.inverse()
    Ts = [T_target_base * nominal.arm.fk(q) * nominal.T_flange_camera for q in drawn]
    tilts = np.degrees([np.arccos(-T.rotation[2, 2]) for T in Ts])
    heights = [T.translation[2] for T in Ts]
    rolls = np.degrees([np.arctan2(T.rotation[1, 0], T.rotation[0, 0]) for T in Ts])
    assert tilts.max() > 30
    assert tilts.min() < 12
    assert max(heights) - min(heights) > 0.2
    assert rolls.min() < -100
    assert rolls.max() > 100


def test_the_same_seed_draws_the_same(nominal: Nominal) -> None:
    one, other = (candidates(nominal, 5, np.random.default_rng(3), CandidateConfig()) for _ in "ab")
    np.testing.assert_array_equal(one, other)


def test_the_inspection_views_touch_nothing(nominal: Nominal) -> None:
    cell, at = collision_model(nominal, clearance=0.02), nominal.q_home
    for view in inspection_work(nominal):
        assert cell.touching(view.q) is None
        assert free_path(cell, at, view.q)
        at = view.q


def test_the_tripod_is_kept_far_from_because_it_is_set_up_by_eye(nominal: Nominal) -> None:
    cell, q_start = collision_model(nominal, clearance=0.005), hand_eye_start(nominal)
    q = nominal.arm.ik(nominal.arm.fk(q_start) * TABLE_2["C"], q_start)
    pair = cell.touching(q)  # the paper's third pose comes within 10 cm of a leg
    assert pair is not None
    assert pair[0] == "chessboard 1"
    assert pair[1].startswith("tripod")


def test_a_camera_in_the_table_is_seen(nominal: Nominal) -> None:
    cell, q_start = collision_model(nominal, clearance=0.005), hand_eye_start(nominal)
    T = nominal.arm.fk(q_start)
    T.translation = T.translation - [0, 0, 0.5]  # 5 cm less than stands between lens and board
    q = nominal.arm.ik(T, q_start)
    pair = cell.touching(q)
    assert pair is not None
    assert "hand" in pair[0]
    assert not free_path(cell, q_start, q)


def test_a_board_out_of_reach_is_one_sentence(
    nominal: Nominal, monkeypatch: pytest.MonkeyPatch
) -> None:
    q_start, far = hand_eye_start(nominal), nominal.T_base_tabletarget.copy()
    monkeypatch.setattr("aoicell.calibration.candidates.hand_eye_start", lambda _: q_start)
    far.translation = far.translation + [0, 0.9, 0]
    moved = replace(nominal, T_base_tabletarget=far)
    with pytest.raises(Unreachable, match="0 of 200 draws can be used, 2 are wanted"):
        candidates(moved, 2, np.random.default_rng(0), CandidateConfig(tilt_deg=10))
