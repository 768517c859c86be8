"""A typical cell that was calibrated and taught without pictures, and what drifts in it."""

from dataclasses import dataclass

from aoicell.benchmark.trial import Session
from aoicell.line.monitor import Monitor, MonitorConfig, Reading
from aoicell.observation import capture_at
from aoicell.online import Online
from aoicell.scenario import Scenario
from aoicell.sim.world import World
from aoicell.transforms import SE3

SCENARIO = Scenario(name="line", methods=["aoicell"], pictures=False, seed=4, tolerance_mm=0.5)


@dataclass(frozen=True)
class TaughtCell:
    """Everything of it; the session's cell is behind the fence."""

    session: Session
    online: Online

    @property
    def world(self) -> World:
        return self.session.world

    def rewind(self, slot: int = 0) -> None:
        """As it was built, the board where it was taught, the arm at home."""
        self.move_camera(SE3.Identity())
        self.world.place_board(self.session.T_base_board_taught)
        self.world.begin(slot)

    def move_camera(self, moved: SE3) -> None:
        """The camera on its mount, in its own axes."""
        built = self.world.as_built.geometry
        self.world.change_camera(built.T_flange_camera * moved, built.cameras["hand"])

    def reading(self, monitor: Monitor, slot: int) -> Reading:
        """The reference, as it is seen in that slot."""
        self.world.begin(slot)
        cell, template = self.session.cell, self.online.template
        cell.move(template.look.state.q)
        return monitor.read(capture_at(cell, [o.state.q for o in template.references]))

    def monitor(self, looks: int = 5, config: MonitorConfig | None = None) -> Monitor:
        """A monitor that has seen the unchanged cell so often."""
        self.rewind()
        monitor = Monitor(self.online, config or MonitorConfig())
        monitor.set_up([self.reading(monitor, 9000 + k) for k in range(looks)])
        return monitor
