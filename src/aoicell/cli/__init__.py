"""The command line.

Exit codes: 0 done, 1 a check did not hold, 2 bad input, 3 refused by a quality gate, 130
stopped by Ctrl-C. Results go to stdout (with --json for machines), messages to stderr.
"""

from aoicell.cli import (
    calibrate,
    check,
    line,
    machine,
    plan,
    play,
    report,
    runs,
    scan,
    scenarios,
    view,
)
from aoicell.cli.app import app, main

__all__ = [
    "app",
    "calibrate",
    "check",
    "line",
    "machine",
    "main",
    "plan",
    "play",
    "report",
    "runs",
    "scan",
    "scenarios",
    "view",
]
