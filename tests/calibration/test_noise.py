"""The recording tells its own noise."""

import numpy as np
import pytest
from helpers.recorded import Conditions, draw_recording

from aoicell.calibration.bundle import Noise, Solution
from aoicell.calibration.noise import estimate_noise
from aoicell.calibration.parameters import DEFAULT_PRIOR, Model, offset_from_prior
from aoicell.calibration.selection import fit
from aoicell.calibration.starts import sight_poses, start_estimate
from aoicell.transforms import Array


def noise_of(conditions: Conditions, model: Model, seeds: int = 4) -> list[Noise]:
    return [fitted(seed, conditions, model).noise for seed in range(seeds)]


def fitted(seed: int, conditions: Conditions, model: Model) -> Solution:
    problem = draw_recording(seed, conditions).problem
    posed = sight_poses(problem)
    start = start_estimate(problem, posed.poses, posed.rms_px)
    return fit(problem, model, start.estimate, start.noise)


def geometric_mean(values: list[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))


def test_pixels_and_arm_are_told_apart() -> None:
    conditions = Conditions(views=15, sigma_px=0.08, repeat_mm=0.03, repeat_deg=0.01)
    found = noise_of(conditions, Model())
    assert geometric_mean([n.sigma for n in found]) == pytest.approx(0.08, rel=0.05)
    assert geometric_mean([n.deviation_m for n in found]) == pytest.approx(3e-5, rel=0.4)
    radians = np.radians(0.01)
    assert geometric_mean([n.deviation_rad for n in found]) == pytest.approx(radians, rel=0.25)


def test_an_arm_that_repeats_exactly_is_seen_to() -> None:
    for noise in noise_of(Conditions(views=12), Model(), seeds=2):
        assert noise.deviation_m < 1e-5
        assert noise.deviation_rad < 1e-5
        assert noise.sigma == pytest.approx(0.05, rel=0.1)


def test_what_is_assumed_of_the_arm_is_scaled_to_what_it_shows() -> None:
    model = Model(robot="joint_terms")
    loose = Conditions(views=15, repeat_mm=0.017, repeat_deg=0.003, joint_deg=0.2, origin_mm=1.2)
    exact = Conditions(views=15, repeat_mm=0.017, repeat_deg=0.003)
    (factor,) = [n.arm_factor for n in noise_of(loose, model, 1)]
    assert 1.5 < factor < 10  # four times what is assumed
    (factor,) = [n.arm_factor for n in noise_of(exact, model, 1)]
    assert factor < 0.5


def test_no_other_noise_is_as_likely() -> None:
    model = Model(robot="joint_terms")
    conditions = Conditions(
        views=9, sigma_px=0.08, repeat_mm=0.1, repeat_deg=0.02, joint_deg=0.1, origin_mm=0.6
    )
    solution = fitted(0, conditions, model)
    assert (solution.normal.view_weights == 1).all()
    noise = estimate_noise(solution)
    logs = np.log([noise.sigma, noise.deviation_m, noise.deviation_rad, noise.arm_factor])
    for step in 0.05 * np.eye(4):
        less, here, more = (unlikeliness(solution, np.exp(logs + k * step)) for k in (-1, 0, 1))
        assert less + more > 2 * here
        lowest = 0.05 / 2 * (less - more) / (less - 2 * here + more)  # of the parabola
        assert lowest == pytest.approx(0, abs=2e-3)


def unlikeliness(solution: Solution, sigmas: Array) -> float:
    """Minus twice the restricted log likelihood from whole covariances, and what is expected."""
    variances = np.repeat(sigmas[1:3] ** 2, 3)
    layout, lin = solution.layout, solution.lin
    prior = Noise(*map(float, sigmas)).prior(layout)
    offset = offset_from_prior(layout, solution.estimate)
    A, b, value = np.diag(prior**-2.0), -offset / prior**2, float(((offset / prior) ** 2).sum())
    root = np.sqrt(solution.normal.row_weights)
    for v, rows in enumerate(lin.rows):
        D = lin.J_view[rows] * root[rows, None]
        C = sigmas[0] ** 2 * np.eye(len(D)) + (D * variances) @ D.T
        r = lin.residuals[rows] * root[rows] + D @ solution.estimate.deviations[v]
        J = lin.J[rows] * root[rows, None]
        A, b = A + J.T @ np.linalg.solve(C, J), b + J.T @ np.linalg.solve(C, r)
        value += float(r @ np.linalg.solve(C, r) + np.linalg.slogdet(C)[1])
    value += float(np.linalg.slogdet(A)[1] - b @ np.linalg.solve(A, b))
    value += 2 * float(np.log(prior[layout.joints]).sum())
    arm = [DEFAULT_PRIOR.deviation_mm / 1e3, np.radians(DEFAULT_PRIOR.deviation_deg), 1.0]
    return value + float(((np.log(sigmas[1:] / arm) / 2.0) ** 2).sum())
