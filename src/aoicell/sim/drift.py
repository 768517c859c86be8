"""Slow drift of a cell over the boards of a line: the camera's mount creeps, the lamps change.

Each quantity changes by the same amount from board to board, in a direction that is drawn once:
fatigue, settling screws, lamps that age and get dirty have no preferred one.
"""

from dataclasses import dataclass, replace

import numpy as np

from aoicell.sim.as_built import Light
from aoicell.sim.drawing import stream
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array, from_rvec, to_rvec


@dataclass(frozen=True)
class DriftRates:
    """What changes over 100 boards: the camera's place on the flange and its direction, the level
    of the lamps (of the level they had) and the direction of each.
    """

    mount_mm: float = 0.0
    mount_deg: float = 0.0
    light_percent: float = 0.0
    light_deg: float = 0.0


class CellDrift:
    """The drift of one world, by the number of a board; 0 is the cell as it was built.

    The same seed and world give the same directions at any rate.
    """

    def __init__(self, world: World, rates: DriftRates, seed: int) -> None:
        self._world, self.rates = world, rates
        built, index = world.as_built, world.as_built.world

        def direction(name: str) -> Array:
            v = stream(seed, index, -1, f"drift_{name}").standard_normal(3)
            return np.asarray(v / np.linalg.norm(v))

        self._shift, self._turn = direction("mount_shift"), direction("mount_turn")
        self._brighter = float(np.sign(stream(seed, index, -1, "drift_light").uniform(-1, 1)))
        self._lamps = [direction(f"lamp_{k}") for k in range(len(built.light.turns))]

    def T_camera_moved(self, board: int) -> SE3:
        """The camera in its own first place: shifted and turned about itself."""
        hundreds = board / 100
        turn = np.radians(self.rates.mount_deg * hundreds) * self._turn
        return from_rvec(turn, self.rates.mount_mm / 1e3 * hundreds * self._shift)

    def light(self, board: int) -> Light:
        """The lamps at a board."""
        built, hundreds = self._world.as_built.light, board / 100
        level = max(1 + self._brighter * self.rates.light_percent / 100 * hundreds, 0.0)
        angle = np.radians(self.rates.light_deg * hundreds)
        turns = tuple(
            _composed(angle * axis, turn)
            for axis, turn in zip(self._lamps, built.turns, strict=True)
        )
        return replace(built, level=built.level * level, turns=turns)

    def apply(self, board: int) -> None:
        """Bring the world to where the drift has it at a board, whatever it was before."""
        built = self._world.as_built.geometry
        self._world.change_camera(
            built.T_flange_camera * self.T_camera_moved(board), built.cameras["hand"]
        )
        self._world.change_light(self.light(board))


def _composed(second: Array, first: tuple[float, float, float]) -> tuple[float, float, float]:
    """The rotation vector of one small turn after another."""
    if not second.any():
        return first
    nowhere = np.zeros(3)
    turn, _ = to_rvec(from_rvec(second, nowhere) * from_rvec(first, nowhere))
    return float(turn[0]), float(turn[1]), float(turn[2])
