"""The simulated line around a station: boards that arrive, the cell that drifts, set-ups.

A slot is a cycle of the line: a board, or a set-up. All draws hang on the seed and on the number
of the slot or board alone, so that a line goes on in another process as it would have in this one.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass

from aoicell.benchmark.displacement import draw_displacement
from aoicell.benchmark.inspection_trial import draw_population, make_references
from aoicell.benchmark.line.records import SetUpRecord
from aoicell.benchmark.line.settings import LineSettings
from aoicell.benchmark.trial import Session, prepare_in, senses
from aoicell.inspection import BoardInspection, Reference, inspect_board
from aoicell.line.monitor import Monitor
from aoicell.line.station import Station
from aoicell.nominal import load_nominal
from aoicell.observation import Image
from aoicell.sim.drawing import draw, stream
from aoicell.sim.drift import CellDrift
from aoicell.sim.population import Population
from aoicell.sim.world import World


@dataclass(frozen=True)
class SetUp:
    """A station as it was calibrated and taught, its session, and the record of it."""

    station: Station
    session: Session
    record: SetUpRecord


class Conveyor:
    """The world of a line: knows the truth, and what comes next."""

    def __init__(self, settings: LineSettings) -> None:
        self.settings, scenario = settings, settings.scenario()
        nominal = scenario.fitted(load_nominal(scenario.cell_folder))
        as_built = draw(nominal, scenario.tolerances, settings.seed)
        self.world = World(nominal, as_built, settings.pictures)
        self.drift = CellDrift(self.world, settings.rates, settings.seed)
        self._board = nominal.board

    def set_up(self, slot: int, before_board: int) -> SetUp:
        """Calibrate, teach a good board where it first lay, and get to know the reference.

        The cell is as it is when the board of that number comes; slot -1 is the very first.
        """
        world, settings = self.world, self.settings
        self._restart(slot, before_board)
        world.place_board(world.as_built.geometry.T_base_board)
        world.populate(None)
        start, rendered = time.perf_counter(), world.render_seconds
        cell, detector = senses(settings.scenario(), world)
        session = prepare_in(world, cell, detector, settings.scenario())
        online = session.online("aoicell")
        monitor = Monitor(online, settings.monitor)
        if settings.pictures:
            references = make_references(online, session.golden)
            station = Station(cell, online, monitor, references, self._inspect)
        else:
            station = Station(cell, online, monitor)
        readings = station.get_ready(settings.set_up_looks)
        seconds = time.perf_counter() - start - (world.render_seconds - rendered)
        record = SetUpRecord(slot, before_board, list(readings), world.clock, seconds)
        return SetUp(station, session, record)

    def _inspect(
        self, pictures: Mapping[str, Image], references: Mapping[str, Reference]
    ) -> BoardInspection:
        return inspect_board(pictures, references, self._board)

    def bring(self, slot: int, number: int, session: Session) -> Population:
        """Let a board arrive: somewhere, with few or no defects, the arm at home."""
        self._restart(slot, number)
        population = draw_population(
            self.settings.scenario(self.defects_of(number)), self.world, number
        )
        if self.settings.pictures:
            self.world.populate(population)
        T_taught = session.T_base_board_taught
        motion = draw_displacement(session.scenario, self.world, T_taught, number)
        self.world.place_board(motion * T_taught)
        return population

    def defects_of(self, number: int) -> int:
        """How many defects a board has."""
        rng = stream(self.settings.seed, 0, number, "defective")
        defective = rng.uniform() < self.settings.defective_percent / 100
        return int(rng.integers(1, self.settings.most_defects + 1)) if defective else 0

    def _restart(self, slot: int, board: int) -> None:
        self.drift.apply(board)
        self.world.begin(slot)

    def close(self) -> None:
        """Free the OpenGL contexts."""
        self.world.close()
