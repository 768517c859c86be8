"""What a line is like: the cell, the boards, the drift, and when to raise alarms."""

from pathlib import Path
from typing import Annotated, Any

import tomli_w
from pydantic import ValidationError

from aoicell.errors import ScenarioError
from aoicell.line.monitor import MonitorConfig
from aoicell.scenario import Displacement, Scenario
from aoicell.scenario.complaints import explain
from aoicell.scenario.model import Inspection, Profile
from aoicell.scenario.strict import Strict, within
from aoicell.sim.drift import DriftRates
from aoicell.toml_table import read_toml


class LineSettings(Strict):
    """One line, with everything that its results follow from but their number of boards.

    `defective_percent` of the boards have 1 to `most_defects` defects, the others none. Drift is by
    100 boards. `views` is a file of inspection views ("": those of the cell's board). Boards are
    compared with `golden_samples` good ones. After each set-up the station looks at its reference
    `set_up_looks` times. Without `pictures` points are projected, and nothing is inspected: for
    studies of the drift monitor.
    """

    profile: Profile = "typical"
    seed: Annotated[int, within(0, 2**32 - 1)] = 0
    cell: str = ""
    views: str = ""
    defective_percent: Annotated[float, within(0, 100)] = 20.0
    most_defects: Annotated[int, within(1, 50)] = 3
    golden_samples: Annotated[int, within(1, 10)] = 3
    displacement: Displacement = Displacement()
    mount_mm: Annotated[float, within(0, 100)] = 0.2
    mount_deg: Annotated[float, within(0, 30)] = 0.03
    light_percent: Annotated[float, within(0, 1000)] = 5.0
    light_deg: Annotated[float, within(0, 360)] = 1.0
    tolerance_mm: Annotated[float, within(1e-3, 1e3)] = 0.5
    share: Annotated[float, within(0, 1)] = 0.25
    light_tolerance: Annotated[float, within(0.01, 0.9)] = 0.3
    run_length: Annotated[float, within(20, 1e6)] = 1000.0
    weight: Annotated[float, within(0.05, 1)] = 0.2
    set_up_looks: Annotated[int, within(2, 100)] = 5
    pictures: bool = True

    @property
    def rates(self) -> DriftRates:
        """The drift of the cell."""
        return DriftRates(self.mount_mm, self.mount_deg, self.light_percent, self.light_deg)

    @property
    def monitor(self) -> MonitorConfig:
        """When to raise alarms, for boards that come turned as far as they do here."""
        turn = self.displacement.turn_deg
        return MonitorConfig(
            run_length=self.run_length, weight=self.weight, share=self.share,
            tolerance_mm=self.tolerance_mm, turn_deg=max(abs(turn.min), abs(turn.max)),
            light_tolerance=self.light_tolerance,
        )  # fmt: skip

    def scenario(self, defects: int = 0) -> Scenario:
        """The scenario of a board with so many defects."""
        return Scenario(
            name="line", cell=self.cell, profile=self.profile, seed=self.seed, views=self.views,
            methods=["aoicell"], tolerance_mm=self.tolerance_mm, displacement=self.displacement,
            pictures=self.pictures, inspect=self.pictures,
            inspection=Inspection(defects=defects, golden_samples=self.golden_samples),
        )  # fmt: skip

    def to_toml(self) -> str:
        """The settings as a file that reads back the same."""
        return tomli_w.dumps(self.model_dump())


def line_settings(**values: Any) -> LineSettings:
    """Settings of these values, those that are None left out. Raises ScenarioError."""
    try:
        given = {key: value for key, value in values.items() if value is not None}
        return LineSettings(**given)
    except ValidationError as error:
        raise ScenarioError(f"line: {explain(error, LineSettings)}") from None


def read_settings(path: Path) -> LineSettings:
    """The settings of a file. Raises ScenarioError."""
    return line_settings(**read_toml(path, "no such file; a line's folder holds it", ScenarioError))
