"""OpenCV's closed forms behind checks: exact data give the truth, nonsense is refused."""

import numpy as np
import pinocchio as pin
import pytest

from aoicell.calibration.closed_forms import (
    CLOSED_FORMS,
    ClosedForm,
    every_closed_form,
    scale_from_motion,
    solve_closed_form,
)
from aoicell.errors import Implausible, InputError
from aoicell.transforms import SE3, distance_deg, distance_mm, from_rvec, rotation, translation

X = from_rvec([0.02, -0.03, 1.5], [0.03, -0.05, 0.08])
Z = from_rvec([0.1, 0.02, -2.0], [0.4, 0.8, 0.02])
DOWN = rotation("x", np.pi)


def pairs(rng: np.random.Generator, count: int = 8) -> tuple[list[SE3], list[SE3]]:
    """A camera around a target that it sees from above, the first exactly straight down."""
    As, Bs = [], []
    for k in range(count):
        turn = np.zeros(3) if k == 0 else rng.uniform(-0.5, 0.5, 3)
        aim = rng.uniform(-0.05, 0.05, 3)
        T_target_camera = SE3(pin.exp3(turn), aim) * DOWN * translation(z=-rng.uniform(0.4, 0.6))
        As.append(Z * T_target_camera * X.inverse())
        Bs.append(T_target_camera.inverse())
    return As, Bs


@pytest.mark.parametrize("method", CLOSED_FORMS)
def test_exact_pairs_give_the_truth(method: ClosedForm, rng: np.random.Generator) -> None:
    result = solve_closed_form(*pairs(rng), method)
    assert distance_mm(result.X, X) < 1e-4
    assert distance_deg(result.X, X) < 1e-4
    assert distance_mm(result.Z, Z) < 1e-4
    assert distance_deg(result.Z, Z) < 1e-4
    assert result.scatter_mm < 1e-4


@pytest.mark.parametrize("method", CLOSED_FORMS)
def test_eye_to_hand_is_the_same_with_the_arm_inverted(
    method: ClosedForm, rng: np.random.Generator
) -> None:
    _, Bs = pairs(rng)
    # the camera X on the base, the target Z on the flange: flange = X B Z^-1
    flanges = [X * B * Z.inverse() for B in Bs]
    result = solve_closed_form([A.inverse() for A in flanges], Bs, method)
    assert distance_mm(result.X, X) < 1e-4
    assert distance_mm(result.Z, Z) < 1e-4


def test_the_methods_differ_on_noisy_pairs(rng: np.random.Generator) -> None:
    # were `method` passed by position, OpenCV would take its default for all
    As, Bs = pairs(rng)
    noisy = [B * pin.exp6(2e-3 * rng.standard_normal(6)) for B in Bs]
    solved, failed = every_closed_form(As, noisy)
    assert not failed
    places = {tuple(np.round(r.X.translation, 9)) for r in solved}
    assert len(places) == len(CLOSED_FORMS)


def test_degenerate_motion_gives_no_answer_that_stands_as_if_it_were_good(
    rng: np.random.Generator,
) -> None:
    As = [Z * translation(*rng.uniform(-0.1, 0.1, 3)) * X.inverse() for _ in range(6)]
    Bs = [(A * X).actInv(Z) for A in As]
    solved, failed = every_closed_form(As, Bs)
    assert len(solved) + len(failed) == len(CLOSED_FORMS)
    assert failed
    for result in solved:
        assert np.isfinite(result.X.homogeneous).all()
        assert np.linalg.det(result.X.rotation) > 0


def test_too_few_and_unknown_are_refused(rng: np.random.Generator) -> None:
    As, Bs = pairs(rng)
    with pytest.raises(Implausible, match="2 arm poses"):
        solve_closed_form(As[:2], Bs[:2], "park")
    with pytest.raises(InputError, match="did you mean 'park'"):
        solve_closed_form(As, Bs, "prak")  # type: ignore[arg-type]


def test_the_motion_measures_the_target(rng: np.random.Generator) -> None:
    As, Bs = pairs(rng)
    small = [SE3(B.rotation, B.translation / 1.023) for B in Bs]
    factor, std, X_found = scale_from_motion(As, small, X)
    assert factor == pytest.approx(1.023, abs=1e-9)
    assert std < 1e-6
    assert distance_mm(X_found, X) < 1e-6
    still = [As[0]] * 5
    assert scale_from_motion(still, [Bs[0]] * 5, X)[1] == np.inf
