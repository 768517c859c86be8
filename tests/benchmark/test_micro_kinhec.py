"""Our solver at the neutral referee: registered, both mounts read rightly, ranked as it should."""

import numpy as np
import pytest

pytest.importorskip("kinhec", reason="needs the extra 'bench'")
pandas = pytest.importorskip("pandas")

from aoicell.benchmark.micro import kinhec  # noqa: E402
from aoicell.errors import Implausible  # noqa: E402
from aoicell.transforms import SE3, from_matrix, from_xyz_rpy, looking_at  # noqa: E402

X = from_xyz_rpy([0.012, -0.034, 0.071], [0.10, -0.25, 0.60])
Y = from_xyz_rpy([0.50, 0.10, 0.20], [0.3, -0.1, 1.50])


def pairs(in_hand: bool, count: int = 9) -> kinhec.Keyframes:
    """A X = Y B with a target half a metre before the camera, and noise of 0.1 mm, 0.2 mrad."""
    rng = np.random.default_rng(3)
    A, B = [], []
    for _ in range(count):
        tilt = (rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6))
        seen = looking_at([0, 0, 0], rng.uniform(0.4, 0.7), tilt, rng.uniform(-1.5, 1.5))
        b = seen if in_hand else seen.inverse()
        A.append((Y * b * X.inverse()).homogeneous)
        shaken = SE3(b.rotation, b.translation + rng.normal(0, 1e-4, 3))
        B.append(shaken.homogeneous)
    return np.array(A), np.array(B), np.zeros((0, 4, 4)), np.zeros((0, 4, 4))


@pytest.mark.parametrize("in_hand", [True, False])
def test_x_and_y_are_found_without_being_told_the_mount(in_hand: bool) -> None:
    found = kinhec.solve(pairs(in_hand), np.random.default_rng(0))
    for name, truth in (("X", X), ("Y", Y)):
        gap = from_matrix(found[name]).actInv(truth)
        assert np.linalg.norm(gap.translation) < 1e-3
        assert np.linalg.norm(gap.rotation - np.eye(3)) < 5e-3


def test_too_few_pairs_are_refused() -> None:
    with pytest.raises(Implausible):
        kinhec.solve(pairs(True, 3), np.random.default_rng(0))


def test_the_referee_has_our_solver_only_meanwhile() -> None:
    from kinhec import benchmark

    before = dict(benchmark.SOLVERS)
    with kinhec.registered(benchmark):
        assert kinhec.NAME in benchmark.SOLVERS
        assert kinhec.NAME in benchmark.SOLVER_DOCS
    assert before == benchmark.SOLVERS


def test_ranks_count_who_is_better_with_the_true_clock() -> None:
    errors = {"a": [1, 3, 5], "aoicell": [2, 2, 9], "b": [9, 9, 9]}
    table = [
        {"track": "pnp", "eval_sync": sync, "solver": solver, "ok": True, "runtime_ms": 1.0,
         "X_trans_err_mm": mm * (1 if sync == "oracle" else 100), "X_rot_err_deg": -mm}
        for solver, all_mm in errors.items() for mm in all_mm
        for sync in ("oracle", "estimated")
    ]  # fmt: skip
    table[0]["ok"] = False
    rows = kinhec.leaderboard(pandas.DataFrame(table))
    oracle = [row for row in rows if row["clock"] == "oracle"]
    assert [row["solver"] for row in oracle] == ["aoicell", "a", "b"]
    assert [row["trans_mm"] for row in oracle] == [2, 4, 9]
    assert oracle[1]["solved"] == 2
    assert kinhec.ranks(rows, "trans_mm") == {"pnp": 1}
    assert kinhec.ranks(rows, "rot_deg") == {"pnp": 3}


@pytest.mark.slow
def test_the_smoke_tier_is_won_on_pnp() -> None:
    result = kinhec.bench_kinhec(quick=True)
    assert result["ratios"]["rank_by_track"] == {"pnp": 1}
