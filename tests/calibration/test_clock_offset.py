"""The clock offset of two pose streams with known truth."""

import numpy as np
import pinocchio as pin
import pytest

from aoicell.calibration.clock_offset import estimate_clock_offset
from aoicell.errors import Implausible
from aoicell.transforms import SE3, Array, from_xyz_rpy

X = from_xyz_rpy([0.012, -0.034, 0.071], [0.10, -0.25, 0.60])
Z = from_xyz_rpy([-0.35, 0.85, 0.40], [0.02, -0.01, 1.50])
Streams = tuple[Array, list[SE3], Array, list[SE3]]


def flange(t: float) -> SE3:
    turn = np.array([0.3 * np.sin(1.7 * t), 0.4 * np.sin(1.1 * t + 1), 0.5 * np.sin(2.3 * t + 2)])
    return SE3(pin.exp3(turn), np.array([0.1 * np.sin(t), 0.9, 1.2]))


def streams(
    offset: float, noise: float = 0.0, wrong: int = 0
) -> tuple[Array, list[SE3], Array, list[SE3]]:
    rng = np.random.default_rng(2)
    t_robot, taken = np.arange(0, 6, 0.004), np.arange(0.5, 5.5, 1 / 30)
    seen = [(flange(t) * X).actInv(Z) for t in taken]
    seen = [T * SE3(pin.exp3(noise * rng.standard_normal(3)), np.zeros(3)) for T in seen]
    for k in rng.choice(len(seen), wrong, replace=False):
        seen[k] = seen[k] * SE3(pin.exp3(rng.standard_normal(3)), np.zeros(3))
    return t_robot, [flange(t) for t in t_robot], taken + offset, seen


@pytest.mark.parametrize("offset", [0.0, 0.05, -0.137])
def test_exact_streams_give_the_offset_with_its_sign(offset: float) -> None:
    found = estimate_clock_offset(*streams(offset))
    assert found.offset == pytest.approx(offset, abs=2e-4)


def test_noise_and_wrong_poses_leave_it_within_its_deviation() -> None:
    found = estimate_clock_offset(*streams(0.08, noise=2e-3, wrong=15))
    assert found.std < 3e-3
    assert found.offset == pytest.approx(0.08, abs=4 * found.std)


def test_streams_that_tell_nothing_are_refused() -> None:
    t_robot, Ts, t_camera, seen = streams(0.0)
    with pytest.raises(Implausible, match="too little"):
        estimate_clock_offset(t_robot, [Ts[0]] * len(Ts), t_camera, [seen[0]] * len(seen))
    with pytest.raises(Implausible, match="same time"):
        estimate_clock_offset(t_robot, Ts, t_camera + 60, seen)
