"""A synthetic robot inspection cell to regress calibration and localisation against.

The names below are the public Python interface; each is loaded when it is first used.
"""

from importlib import import_module
from importlib.metadata import version
from typing import Any

__version__ = version("aoicell")

_PUBLIC = {
    "aoicell.benchmark.runner": ("run_scenario",),
    "aoicell.benchmark.trial": ("describe", "prepare", "run_trial"),
    "aoicell.benchmark.values": ("trial_values",),
    "aoicell.camera": ("Camera",),
    "aoicell.correction": ("Correction", "correct"),
    "aoicell.errors": ("AoicellError", "InputError", "Refused"),
    "aoicell.nominal": ("Nominal", "load_nominal"),
    "aoicell.observation": ("Cell", "Observation", "Renderer", "RobotState"),
    "aoicell.pipeline": ("METHODS", "Calibration", "Method"),
    "aoicell.registration": ("Template",),
    "aoicell.resources": ("find",),
    "aoicell.robot": ("Arm",),
    "aoicell.targets.layout": ("LocatedLayout", "locate_layout"),
    "aoicell.scenario": ("Scenario", "load_scenario"),
    "aoicell.transforms": ("SE3",),
}
_WHERE = {name: module for module, names in _PUBLIC.items() for name in names}

__all__ = [*_WHERE, "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module 'aoicell' has no attribute {name!r}")
    return getattr(import_module(_WHERE[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
