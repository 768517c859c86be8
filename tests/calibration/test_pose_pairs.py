"""Hand-eye from pose pairs with known truth: exact, noisy, half turns, outliers, degenerate."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
import pytest

from aoicell.calibration.closed_forms import every_closed_form
from aoicell.calibration.pose_noise import PoseNoise, camera_covariances, covariances
from aoicell.calibration.pose_pairs import (
    Mount,
    PosePairs,
    PosePairsConfig,
    _Guess,
    _Pairs,
    solve_pose_pairs,
)
from aoicell.errors import Implausible, InputError
from aoicell.transforms import (
    SE3,
    distance_deg,
    distance_mm,
    from_xyz_rpy,
    looking_at,
    rotation,
    translation,
)

# No two axes alike, so that a swap or an inverse cannot go unnoticed.
X_TRUE = from_xyz_rpy([0.012, -0.034, 0.071], [0.10, -0.25, 0.60])
Z_TRUE = from_xyz_rpy([-0.35, 0.85, 0.40], [0.02, -0.01, 1.50])
NONE = np.zeros(6)
ONE_FORM = PosePairsConfig(forms=("points",))
Pairs = tuple[list[SE3], list[SE3]]


def views(count: int, seed: int = 0, tilt: float = 0.5) -> list[SE3]:
    """T_camera_target, tilted both ways, rolled, from 0.35 to 0.7 m."""
    rng = np.random.default_rng(seed)
    return [
        looking_at(
            [*rng.uniform(-0.05, 0.05, 2), 0], rng.uniform(0.35, 0.7),
            (rng.uniform(-tilt, tilt), rng.uniform(-tilt, tilt)), rng.uniform(-2, 2),
        ).inverse()
        for _ in range(count)
    ]  # fmt: skip


def flanges(Bs: Sequence[SE3], X: SE3, Z: SE3, mount: Mount = "eye_in_hand") -> list[SE3]:
    """T_base_flange that shows the target there: A X B = Z, A inverted eye to hand."""
    As = [Z * B.inverse() * X.inverse() for B in Bs]
    return As if mount == "eye_in_hand" else [A.inverse() for A in As]


def noisy(count: int, seed: int, mount: Mount = "eye_in_hand", outliers: int = 0) -> Pairs:
    """Poses from noisy points of a 120 mm target, 0.3 px at 1000 px, and 0.1 mm of the flange."""
    rng = np.random.default_rng([seed, 1])
    exact = views(count, seed)
    As = flanges(exact, X_TRUE, Z_TRUE, mount)
    V = camera_covariances("points", np.array([3e-4, 0.06]), exact)
    Bs = []
    for B, C in zip(exact, V, strict=True):
        e = rng.multivariate_normal(np.zeros(6), C)
        Bs.append(SE3(pin.exp3(e[3:]) @ B.rotation, B.translation + e[:3]))
    for k in rng.choice(count, outliers, replace=False):
        Bs[k] = Bs[k] * pin.exp6(rng.normal(0, [0.05] * 3 + [0.3] * 3))
    spread = [1e-4] * 6
    return [A * pin.exp6(rng.normal(0, spread)) for A in As], Bs


def off(found: PosePairs) -> tuple[float, float]:
    return distance_mm(found.X, X_TRUE), distance_deg(found.X, X_TRUE)


@pytest.mark.parametrize("mount", ["eye_in_hand", "eye_to_hand"])
def test_exact_pairs_give_the_truth(mount: Mount) -> None:
    Bs = views(8)
    found = solve_pose_pairs(flanges(Bs, X_TRUE, Z_TRUE, mount), Bs, mount)
    assert max(off(found)) < 1e-4
    assert distance_mm(found.Z, Z_TRUE) < 1e-4
    assert found.scale == 1
    np.testing.assert_allclose(found.weights, 1)


def test_exact_half_turns() -> None:
    """A camera that looks straight down, mounted the other way round: all logs at pi."""
    X, Z = rotation("x", np.pi) * translation(0.05, 0.02, 0.1), rotation("z", np.pi)
    Bs = [
        translation(0.02, 0.01, 0.5) * rotation("x", np.pi),
        translation(0, 0, 0.5) * rotation("y", np.pi),
        translation(0.03, 0, 0.4) * rotation("x", np.pi) * rotation("y", 0.4),
        translation(0, 0.03, 0.6) * rotation("x", np.pi + 0.4),
        translation(-0.02, 0, 0.5) * rotation("y", np.pi) * rotation("x", 0.3),
    ]
    found = solve_pose_pairs(flanges(Bs, X, Z), Bs, config=ONE_FORM)
    assert distance_mm(found.X, X) < 1e-3
    assert distance_deg(found.X, X) < 1e-3


@pytest.mark.parametrize("mount", ["eye_in_hand", "eye_to_hand"])
def test_noisy_pairs_are_nearer_than_by_any_closed_form(mount: Mount) -> None:
    ours, best = [], []
    for seed in range(3):
        As, Bs = noisy(14, seed, mount)
        ours.append(off(solve_pose_pairs(As, Bs, mount, ONE_FORM))[0])
        turned = As if mount == "eye_in_hand" else [A.inverse() for A in As]
        solved, _ = every_closed_form(turned, Bs)
        best.append(min(distance_mm(r.X, X_TRUE) for r in solved))  # the best of seven, by truth
    assert np.mean(ours) < 0.7 * np.mean(best)


def test_the_stated_covariance_holds() -> None:
    """Squared distances of X from the truth, six degrees of freedom each."""
    d2 = []
    for seed in range(8):
        As, Bs = noisy(16, seed)
        found = solve_pose_pairs(As, Bs, config=ONE_FORM)
        e = pin.log6(found.X.actInv(X_TRUE)).vector
        d2.append(e @ np.linalg.solve(found.covariance[:6, :6], e))
    assert 3 < np.mean(d2) < 12


def test_outliers_lose_their_weight() -> None:
    for seed in range(3):
        As, Bs = noisy(20, seed, outliers=5)
        found = solve_pose_pairs(As, Bs, config=ONE_FORM)
        assert (found.weights < 0.1).sum() == 5
        clean = solve_pose_pairs(*noisy(20, seed), config=ONE_FORM)
        assert off(found)[0] < 3 * max(off(clean)[0], 0.1)


def test_a_tracker_with_other_lengths_is_told_and_a_true_one_left_alone() -> None:
    As, Bs = noisy(16, 3)
    free = PosePairsConfig(("points",), "free")
    assert solve_pose_pairs(As, Bs, config=free).scale == 1
    longer = [SE3(B.rotation, 2 * B.translation) for B in Bs]
    found = solve_pose_pairs(As, longer, config=free)
    assert found.scale == pytest.approx(2, rel=5e-3)
    assert off(found)[0] < 2


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_degenerate_motion_is_refused(turn: float) -> None:
    """Pure translations, and turns about one axis alone, do not tell all of X."""
    rng = np.random.default_rng(1)
    As = [SE3(pin.exp3(np.array([0, 0, turn * k])), rng.uniform(-0.1, 0.1, 3)) for k in range(8)]
    Bs = [(A * X_TRUE).actInv(Z_TRUE) for A in As]
    with pytest.raises(Implausible):
        solve_pose_pairs(As, Bs)


def test_what_is_no_pair_is_named() -> None:
    Bs = views(5)
    As = flanges(Bs, X_TRUE, Z_TRUE)
    with pytest.raises(InputError, match="4 poses of the flange and 5"):
        solve_pose_pairs(As[:4], Bs)
    with pytest.raises(Implausible, match="3 are too few"):
        solve_pose_pairs(As[:3], Bs[:3])
    As[2] = SE3(-np.eye(3), np.zeros(3))
    with pytest.raises(InputError, match="T_base_flange of pair 3"):
        solve_pose_pairs(As, Bs)


@pytest.mark.parametrize("mount", ["eye_in_hand", "eye_to_hand"])
def test_derivatives_match_finite_differences(mount: Mount) -> None:
    Bs = views(3)
    As = flanges(Bs, X_TRUE, Z_TRUE, mount)
    Fs = [A.inverse() if mount == "eye_in_hand" else A for A in As]
    X, Z, s, h = X_TRUE * pin.exp6(np.full(6, 0.01)), Z_TRUE, 1.1, 1e-6

    def residuals(step: np.ndarray, flange: np.ndarray = NONE) -> np.ndarray:
        moved = [A * pin.exp6(flange) for A in As]
        turned = [A.inverse() if mount == "eye_in_hand" else A for A in moved]
        at = _Guess(X * pin.exp6(step[:6]), Z * pin.exp6(step[6:12]), s + step[12])
        return _Pairs(tuple(turned), tuple(Bs), mount).linearise(at, True).residuals

    lin = _Pairs(tuple(Fs), tuple(Bs), mount).linearise(_Guess(X, Z, s), True)
    for k in range(13):
        d = h * np.eye(13)[k]
        numeric = -(residuals(d) - residuals(-d)) / (2 * h)
        np.testing.assert_allclose(lin.J[:, :, k], numeric, atol=2e-2)  # log3 near 0.02 rad
    for k in range(6):
        d = h * np.eye(6)[k]
        numeric = -(residuals(np.zeros(13), d) - residuals(np.zeros(13), -d)) / (2 * h)
        np.testing.assert_allclose(lin.by_flange[:, :, k], numeric, atol=2e-2)


def test_a_flat_target_is_uncertain_in_depth_and_tilt() -> None:
    near, far = (translation(z=z) * rotation("x", np.pi + 0.3) for z in (0.4, 0.8))
    V = camera_covariances("points", np.array([3e-4, 0.05]), [near, far])
    std = np.sqrt(np.array([np.diag(v) for v in V]))
    assert std[0, 2] > 3 * std[0, 0]
    assert std[0, 3] > 2 * std[0, 5]
    assert std[1, 0] / std[0, 0] == pytest.approx(2, rel=0.05)
    assert std[1, 2] / std[0, 2] == pytest.approx(4, rel=0.1)
    noise = PoseNoise("even", np.array([1e-3, 2e-3, 3e-3]), np.array([1e-4, 2e-4]))
    total = covariances(noise, [near], np.eye(6)[None])
    expected = [1e-6 + 1e-8] * 2 + [4e-6 + 1e-8] + [9e-6 + 4e-8] * 3
    np.testing.assert_allclose(np.diag(total[0]), expected)
