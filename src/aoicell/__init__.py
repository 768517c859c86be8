"""A synthetic robot inspection cell to regress calibration and localisation against."""

from importlib.metadata import version

__version__ = version("aoicell")
