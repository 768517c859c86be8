"""Robot programs as text for makers' controllers.

Held by golden files; none of it has run on a controller, and each file says so in its head. HRL
(HIWIN's HRSS 3: E6AXIS, PTP, FINE, WAIT SEC, $DO, $DI) is put together from published examples, for
the manual was not at hand: check a file offline before it moves an arm. URScript: Universal Robots'
script manual for software 5 (movej, set_standard_digital_out, get_standard_digital_in, sleep,
textmsg).
"""

from collections.abc import Callable, Mapping
from itertools import count
from types import MappingProxyType

from aoicell.planning.program import Capture, Move, Program

TRIGGER, DONE = 1, 1  # digital output that asks for a picture, input that says it is taken
_PULSE = 0.05  # how long the trigger is held (s)


def to_hrl(program: Program) -> str:
    """HIWIN's robot language (a .hrb file): PTP moves at full speed, three decimals of a degree.

    PTP starts and stops all joints together; whether they stay in proportion on the way is the
    controller's affair.
    """
    points = [_axes(program.start_deg), *(_axes(move.joints_deg) for move in program.moves)]
    lines = [
        ";Version:310",
        *(f"; {line}" for line in _head(program)),
        f"; $DO[{TRIGGER}] triggers the camera, $DI[{DONE}] says that the picture is taken.",
        ";[Point&S]",
        ";[Point&E]",
        ";[Program&SV2]",
        *(f"E6AXIS P{number}={point}" for number, point in enumerate(points)),
        "; start: the arm must stand here before",
        "PTP P0 FINE=1 Vel=10% Acc=50% TOOL[0] BASE[0]",
    ]
    numbers = count(1)
    for step in program.steps:
        lines += _hrl_move(next(numbers), step) if isinstance(step, Move) else _hrl_capture(step)
    return "\n".join([*lines, ";[Program&E]", ""])


def _axes(joints_deg: tuple[float, ...]) -> str:
    return "{" + ",".join(f"A{n} {angle:.3f}" for n, angle in enumerate(joints_deg, 1)) + "}"


def _hrl_move(point: int, move: Move) -> list[str]:
    return [
        f"; {_one_line(move.to)}: planned in {move.duration:.3f} s",
        f"PTP P{point} FINE=1 Vel=100% Acc=100% TOOL[0] BASE[0]",
    ]


def _hrl_capture(picture: Capture) -> list[str]:
    return [
        f"; picture {picture.view}",
        f"$DO[{TRIGGER}]=TRUE",
        f"WAIT SEC {_PULSE:g}",
        f"$DO[{TRIGGER}]=FALSE",
        f"WAIT FOR $DI[{DONE}]==TRUE",
    ]


def to_urscript(program: Program) -> str:
    """URScript: movej in radians, each in the time that was planned for it."""
    lines = [
        *(f"# {line}" for line in _head(program)),
        "# A UR arm has other links: plan with its own URDF before this means anything there.",
        f"# Standard output {TRIGGER} triggers the camera, input {DONE} says that it is done.",
        f"def {_identifier(program.name)}():",
        f"  movej({_radians(program.start_deg)}, a=0.5, v=0.2)  # start: must stand here before",
    ]
    for step in program.steps:
        lines += _ur_move(step) if isinstance(step, Move) else _ur_capture(step)
    return "\n".join([*lines, "end", ""])


def _radians(joints_deg: tuple[float, ...]) -> str:
    return "[" + ", ".join(f"d2r({angle:.6f})" for angle in joints_deg) + "]"


def _ur_move(move: Move) -> list[str]:
    return [f"  movej({_radians(move.joints_deg)}, t={move.duration:.3f})  # {_one_line(move.to)}"]


def _ur_capture(picture: Capture) -> list[str]:
    return [
        f'  textmsg("picture {picture.view}")',
        f"  set_standard_digital_out({TRIGGER}, True)",
        f"  sleep({_PULSE:g})",
        f"  set_standard_digital_out({TRIGGER}, False)",
        f"  while not get_standard_digital_in({DONE}):",
        "    sync()",
        "  end",
    ]


def _head(program: Program) -> list[str]:
    return [
        f"Program '{_one_line(program.name)}' of aoicell for the arm {program.arm}: "
        f"{len(program.views)} pictures, {program.duration:.2f} s of moves.",
        "NOT RUN ON A CONTROLLER: check every line and step through at low speed first.",
    ]


def _one_line(text: str) -> str:
    """A text that cannot end its comment."""
    return " ".join(text.split())


def _identifier(name: str) -> str:
    plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
    return plain if plain[:1].isalpha() else f"program_{plain}"


# Suffix and writer of each language.
EXPORTERS: Mapping[str, tuple[str, Callable[[Program], str]]] = MappingProxyType(
    {"hrl": (".hrb", to_hrl), "urscript": (".script", to_urscript)}
)
