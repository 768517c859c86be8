"""What a result depends on beside the scenario: versions, machine, git state."""

import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from aoicell.resources import data_root

PACKAGES = ("aoicell", "mujoco", "pin", "numpy", "scipy", "opencv-python-headless")


def describe_environment() -> dict[str, Any]:
    """Versions of what computes, the platform, and the state of the checkout."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "machine": platform.machine(),
        "packages": {name: _version(name) for name in PACKAGES},
        "git": git_state(),
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def git_state() -> dict[str, Any] | None:
    """Commit and whether the checkout is clean; None outside a checkout."""
    commit = _git("rev-parse", "HEAD")
    if commit is None:
        return None
    return {"commit": commit, "clean": _git("status", "--porcelain") == ""}


def _git(*arguments: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(data_root()), *arguments],
            capture_output=True, text=True, timeout=10, check=True,
        )  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
