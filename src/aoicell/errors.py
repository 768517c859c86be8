"""The errors that aoicell raises on purpose.

    AoicellError                     exit code 1: a check did not hold
    |-- InputError                   exit code 2: the caller's input is wrong
    |   |-- ScenarioError            a scenario file: unknown key, illegal value
    |   |-- ModelError               an arm, camera, board or cell folder
    |   `-- RenderingUnavailable     no OpenGL to render with
    |-- Interrupted                  exit code 130: stopped by Ctrl-C, what is done is kept
    `-- Refused                      exit code 3: a quality gate declines
        |-- TargetNotFound           a board or marker is not in the picture
        |-- Unreachable              no joint solution within the limits
        `-- Implausible              a solver's answer fails its checks

Each message is one sentence that names the culprit, where it stands and what
would be right. Anything else that escapes is a defect.
"""

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, Literal

Why = Literal[
    "unspecified",
    "target_not_found",  # a calibration board, a marker when the board is taught
    "marker_not_found",  # too few of the board's markers
    "ambiguous",  # more than one board could be meant
    "inconsistent",  # markers are not where the board has them
    "too_far",  # outside the range that is stated for a displacement
    "reference_not_found",
    "reference_unclear",  # what is seen of the reference is no rigid motion of it
    "contradicted",  # camera, mount or reference moved
    "bound_above_tolerance",
    "unreachable",
    "implausible",
]


class AoicellError(Exception):
    """Base of every error that aoicell raises on purpose."""

    exit_code = 1


class InputError(AoicellError):
    """The caller's input is wrong; nothing was computed."""

    exit_code = 2


class ScenarioError(InputError):
    """A scenario file holds an unknown key or an illegal value."""


class ModelError(InputError):
    """An arm, camera, board or cell folder is incomplete or inconsistent."""


class RenderingUnavailable(InputError):
    """No OpenGL context can be made on this machine."""


class Interrupted(AoicellError):
    """The user stopped a run; what is done is kept."""

    exit_code = 130


class Refused(AoicellError):
    """A quality gate declines to answer: no answer is better than a wrong one.

    `cause` says why in one word for machines, as the sentence does for people.
    """

    exit_code = 3
    cause: Why = "unspecified"

    def __init__(self, message: str = "", cause: Why | None = None) -> None:
        super().__init__(message)
        if cause is not None:
            self.cause = cause


class TargetNotFound(Refused):
    """A calibration board or marker is not (completely) in the picture."""

    cause: Why = "target_not_found"


class Unreachable(Refused):
    """A pose has no joint solution within the limits, or bodies would touch on the way.

    `q_nearest` (dof,): joint angles (rad) that come nearest, where they are known.
    """

    cause: Why = "unreachable"

    def __init__(self, message: str, q_nearest: Any = None) -> None:
        super().__init__(message)
        self.q_nearest = q_nearest


class Implausible(Refused):
    """A solver returned something that cannot be true (NaN, behind the camera, ...)."""

    cause: Why = "implausible"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The tail of an error message: the closest known name, or the list of all."""
    names = sorted(known)
    close = get_close_matches(name, names, n=1)
    return f"did you mean '{close[0]}'?" if close else f"known: {', '.join(names)}"


def shown(value: Any, longest: int = 80) -> str:
    """A value of a file on one line of bounded length, whatever it is."""
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested too deep; an integer of too many digits
        return "..."
    return text if len(text) <= longest else f"{text[: longest - 3]}..."
