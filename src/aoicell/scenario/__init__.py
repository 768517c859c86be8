"""Scenario files: one experiment each, as typed TOML."""

from aoicell.scenario.cases import Case, cases_of
from aoicell.scenario.displacement import Displacement, Range, ShiftRange, TurnRange
from aoicell.scenario.load import load_scenario, scenario_schema
from aoicell.scenario.model import Scenario, Store

__all__ = [
    "Case",
    "Displacement",
    "Range",
    "Scenario",
    "ShiftRange",
    "Store",
    "TurnRange",
    "cases_of",
    "load_scenario",
    "scenario_schema",
]
