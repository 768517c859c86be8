"""The recording tells its own noise."""

import numpy as np
import pytest
from helpers.recorded import Conditions, draw_recording

from aoicell.calibration.bundle import Noise
from aoicell.calibration.parameters import Model
from aoicell.calibration.selection import fit
from aoicell.calibration.starts import sight_poses, start_estimate


def noise_of(conditions: Conditions, model: Model, seeds: int = 4) -> list[Noise]:
    found = []
    for seed in range(seeds):
        problem = draw_recording(seed, conditions).problem
        posed = sight_poses(problem)
        start = start_estimate(problem, posed.poses, posed.rms_px)
        found.append(fit(problem, model, start.estimate, start.noise).noise)
    return found


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
