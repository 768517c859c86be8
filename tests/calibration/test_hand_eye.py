"""Hand-eye in closed form, against poses that are known exactly."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.calibration.hand_eye import HandEyeConfig, Solver, solve_hand_eye
from aoicell.errors import Implausible
from aoicell.transforms import (
    SE3,
    distance_deg,
    distance_mm,
    from_rvec,
    from_xyz_rpy,
    looking_at,
    rotation,
    translation,
)

SOLVERS: tuple[Solver, ...] = ("shah", "li")
EXACT = 1e-6  # mm and deg

# No two axes alike: an inverse, a swap or a transposition cannot go unnoticed.
X = from_xyz_rpy([0.012, -0.034, 0.071], [0.10, -0.25, 0.60])
Z = from_xyz_rpy([-0.350, 0.850, 0.402], [0.02, -0.01, 1.50])

LEANS = [(0.0, 0.0, 0.0), (0.4, 0.0, 0.2), (-0.4, 0.1, -0.3), (0.0, 0.45, 0.1), (0.1, -0.4, 0.8)]


def cameras(leans: Sequence[tuple[float, float, float]], Z: SE3) -> list[SE3]:
    """T_base_camera of looks at a board, by tilt about x and y and roll."""
    return [
        Z * looking_at([0.01 * k, -0.02 * k, 0], 0.5 + 0.02 * k, (x, y), roll)
        for k, (x, y, roll) in enumerate(leans)
    ]


def views(
    leans: Sequence[tuple[float, float, float]] = LEANS, X: SE3 = X, Z: SE3 = Z
) -> tuple[list[SE3], list[SE3]]:
    """Flange poses A and board poses B, with A X B = Z exactly."""
    looks = cameras(leans, Z)
    return [T * X.inverse() for T in looks], [T.actInv(Z) for T in looks]


def assert_exact(A: Sequence[SE3], B: Sequence[SE3], solver: Solver, X: SE3, Z: SE3) -> None:
    result = solve_hand_eye(A, B, HandEyeConfig(solver))
    for found, true in ((result.T_flange_camera, X), (result.T_base_target, Z)):
        assert distance_mm(found, true) < EXACT
        assert distance_deg(found, true) < 1e-5
    assert result.scatter_mm < EXACT
    assert result.scatter_deg < 1e-5
    assert result.views == len(A)


angles = st.floats(-1.2, 1.2)
lengths = st.floats(-0.8, 0.8)
poses = st.builds(
    lambda x, y, z, r, p, w: from_xyz_rpy([x, y, z], [r, p, 2.6 * w]), *[lengths] * 3, *[angles] * 3
)


@pytest.mark.parametrize("solver", SOLVERS)
@given(X=poses, Z=poses)
def test_both_unknowns_come_out_of_exact_poses(solver: Solver, X: SE3, Z: SE3) -> None:
    assert_exact(*views(X=X, Z=Z), solver, X, Z)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    ("X", "Z"),
    [
        (SE3.Identity(), SE3.Identity()),
        (translation(z=0.05), translation(-0.35, 0.85, 0.402) * rotation("z", np.pi / 2)),
        (rotation("z", np.pi), rotation("z", np.pi)),
    ],
)
def test_a_camera_that_looks_straight_down_is_exactly_half_a_turn(
    solver: Solver, X: SE3, Z: SE3
) -> None:
    A, B = views([(0, 0, 0), *LEANS[1:]], X, Z)
    assert B[0].rotation[2, 2] == -1
    assert_exact(A, B, solver, X, Z)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_flanges_half_a_turn_apart(solver: Solver, axis: str) -> None:
    A, _ = views()
    A = [*A, A[0] * rotation(axis, np.pi)]
    assert_exact(A, [(T * X).actInv(Z) for T in A], solver, X, Z)


def test_the_scatter_is_in_millimetres_and_degrees(rng: np.random.Generator) -> None:
    A, B = views([*LEANS, *[(-x, y, -r) for x, y, r in LEANS]])
    noisy = [T * from_rvec(np.radians(0.1) * rng.standard_normal(3), np.zeros(3)) for T in B]
    result = solve_hand_eye(A, noisy)
    assert 0.05 < result.scatter_deg < 0.3
    shifted = [translation(*(1e-3 * rng.standard_normal(3))) * T for T in B]
    result = solve_hand_eye(A, shifted)
    assert 0.5 < result.scatter_mm < 2.5
    assert distance_mm(result.T_flange_camera, X) < 5


def one_axis() -> tuple[list[SE3], list[SE3]]:
    return views([(0, 0, roll) for roll in (0.0, 0.3, -0.3, 0.6)])


def shuffled() -> tuple[list[SE3], list[SE3]]:
    A, B = views()
    return A, [*B[1:], B[0]]


def inverted() -> tuple[list[SE3], list[SE3]]:
    A, B = views()
    return [T.inverse() for T in A], B


def transposed() -> tuple[list[SE3], list[SE3]]:
    A, B = views()
    return [SE3(T.rotation.T, T.translation) for T in A], B


def in_millimetres() -> tuple[list[SE3], list[SE3]]:
    A, B = views()
    return A, [SE3(T.rotation, T.translation * 1e3) for T in B]


def not_a_number() -> tuple[list[SE3], list[SE3]]:
    A, B = views()
    return A, [*B[1:], SE3(np.eye(3), np.full(3, np.nan))]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: views(LEANS[:2]), "2 views are too few; take at least 3"),
        (lambda: views(LEANS[:1]), "1 views are too few"),
        (lambda: ([], []), "0 views are too few"),
        (one_axis, r"turns by 0\.0 deg about a second axis, at least 10 deg are needed"),
        (shuffled, "check that pictures and poses belong together and the pose convention"),
        (inverted, "check that pictures and poses belong together and the pose convention"),
        (transposed, "check that pictures and poses belong together and the pose convention"),
        (in_millimetres, "the board scatters"),
        (not_a_number, "no rigid transform"),
    ],
)
def test_what_cannot_be_solved_is_refused(
    make: Callable[[], tuple[list[SE3], list[SE3]]], reason: str, solver: Solver
) -> None:
    with pytest.raises(Implausible, match=rf"^hand-eye[^\n]*{reason}"):
        solve_hand_eye(*make(), HandEyeConfig(solver))


def test_a_little_motion_about_a_second_axis_is_named() -> None:
    with pytest.raises(Implausible, match=r"turns by [2-7]\.\d deg about a second axis"):
        solve_hand_eye(*views([(0.0, 0, 0), (0.06, 0, 0.3), (-0.06, 0, 0.3), (0, 0, -0.3)]))
