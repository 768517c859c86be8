"""What holds for every test: rendering without a display, one thread for each library, and the
cells that many tests look at.
"""

# ruff: noqa: E402 - the environment has to stand before anything else is imported

import os

# Before any test imports mujoco or numpy, which read these once.
os.environ.setdefault("MUJOCO_GL", "egl")
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "LP_NUM_THREADS"):
    os.environ[_variable] = "1"

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from aoicell.nominal import Nominal, load_nominal
from aoicell.resources import data_root
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL, PAPER
from aoicell.sim.world import World
from aoicell.transforms import Array, from_xyz_rpy

settings.register_profile(
    "aoicell", derandomize=True, max_examples=25, deadline=None, database=None
)
settings.load_profile("aoicell")

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]

# Files whose tests share the calibrated cells of helpers.sessions.
_SHARING = {
    f"tests/{name}.py"
    for name in "benchmark/test_trial test_cli test_doctor test_pipeline test_wall".split()
}


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """`--dist loadfile`, but one worker for all that would make the same sessions again."""
    from xdist.scheduler import LoadFileScheduling

    class Sharing(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            return "sessions" if file in _SHARING else file

    return Sharing(config, log) if config.getvalue("dist") == "loadfile" else None


@pytest.fixture(scope="session")
def nominal() -> Nominal:
    """The shipped cell as designed."""
    return load_nominal(data_root() / "cell")


@pytest.fixture(scope="session")
def second_cell() -> Nominal:
    """A cell with another arm, as designed."""
    return load_nominal(Path(__file__).parent / "data" / "second_cell")


@pytest.fixture(scope="session")
def _ideal_world(nominal: Nominal) -> Iterator[World]:
    world = World(nominal, draw(nominal, IDEAL, seed=0))
    yield world
    world.close()


@pytest.fixture(scope="session")
def _paper_world(nominal: Nominal) -> Iterator[World]:
    world = World(nominal, draw(nominal, PAPER, seed=0))
    yield world
    world.close()


@pytest.fixture
def ideal_world(_ideal_world: World) -> World:
    """An exact world, at home and with fresh streams."""
    return _rewound(_ideal_world)


@pytest.fixture
def paper_world(_paper_world: World) -> World:
    """A world drawn from the profile `paper`, at home and with fresh streams."""
    return _rewound(_paper_world)


def _rewound(world: World) -> World:
    world.begin()
    world.place_board(world.geometry.T_base_board)
    world.arrive(world.nominal.q_home)
    world.begin()
    return world


@pytest.fixture(scope="session")
def taught_poses() -> TaughtPoses:
    """Joint angles by name of the poses that the procedure commands, by nominal kinematics."""
    return _taught_poses


def _taught_poses(nominal: Nominal) -> dict[str, Array]:
    T_camera_flange = nominal.T_flange_camera.inverse()
    marker = next(m for m in nominal.board.markers if m.role == "positioning")
    T_board_marker = from_xyz_rpy([marker.x, marker.y, marker.z], [0, 0, marker.rotation])
    looks = {
        "start": nominal.T_base_tabletarget * nominal.hand_eye_start.T_target_camera,
        "P_check": nominal.T_base_board * T_board_marker * nominal.check.T_target_camera,
        "overview": nominal.T_base_board * nominal.overview.T_target_camera,
        **{v.id: nominal.T_base_board * v.T_target_camera for v in nominal.inspection_views},
    }
    Ts = {name: T_base_camera * T_camera_flange for name, T_base_camera in looks.items()}
    Ts["setup"] = nominal.T_base_flange_setup
    return {name: nominal.arm.ik(T, nominal.q_home, name) for name, T in Ts.items()}


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers, the same in each run."""
    return np.random.default_rng(20210613)
