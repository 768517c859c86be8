"""The bound that localisation is measured against."""

import numpy as np
import pytest

from aoicell.benchmark.micro.localisation import _bound
from aoicell.nominal import Nominal
from aoicell.registration import designed_layout
from aoicell.targets.pose import motion_jacobian, solve_pose
from aoicell.transforms import apply


def test_the_estimator_reaches_the_bound_of_its_own_noise(nominal: Nominal) -> None:
    """Least squares on normal noise is efficient: the ratio is one, up to what was drawn."""
    camera = nominal.cameras["hand"]
    crosses = np.concatenate(list(designed_layout(nominal.board, nominal.marker).values()))
    T = nominal.overview.T_target_camera.inverse()
    points = apply(T, np.array([[0.1, 0.1, 0], [-0.1, 0.05, 0.01], [0, -0.1, 0.02]]))
    covariance = np.diag([0.02**2, 0.02**2])
    bound = _bound(motion_jacobian(crosses, camera, T), points, T, covariance)
    rng, squares = np.random.default_rng(1), []
    for _ in range(150):
        uv = camera.project(crosses, T) + 0.02 * rng.standard_normal((len(crosses), 2))
        off = solve_pose(crosses, uv, camera).T_camera_target * T.inverse()
        squares.append(((apply(off, points) - points) ** 2).sum(axis=1).mean())
    assert np.sqrt(np.mean(squares) / bound) == pytest.approx(1, abs=0.1)
