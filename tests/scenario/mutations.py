"""Scenario files that somebody or something has damaged, in ways that are drawn from a seed."""

import random
import tomllib
from collections.abc import Callable
from typing import Any

import tomli_w

from aoicell.scenario import Scenario
from aoicell.sim.sources import SOURCES
from aoicell.sim.tolerances import Tolerances

Table = dict[str, Any]

_KEYS = (
    *Scenario.model_fields, *Tolerances.model_fields, "shift_mm", "turn_deg", "lift_mm",
    "tilt_deg", "min", "max", "images", "sede", "list", "other",
    "", "a.b", "ü", "\n", "\x00", "\u2028", "x" * 300,
)  # fmt: skip
_SCALARS = (
    -1, 0, 1, 2, 3, 12, 2**32, 2**63, 10**30, 1e-300, 1e308, -0.0, 0.5, float("nan"), float("inf"),
    True, False, "", "x", "paper", "ideal", "typical", "aoicell", "each source", *SOURCES,
    "../cell", "nowhere", "/", "\x00", "a\nb", "é\u2028\u202e😀", "y" * 5000,
)  # fmt: skip
_LINES = (
    "seed = 0x" + "f" * 4000, "seed = " + "9" * 4400, "seed = 1e999", "seed = 1979-05-27",
    "worlds = 07:32:00", "x = null", "title = " + "[" * 2000 + "]" * 2000, "k." * 1500 + "k = 1",
    "cases." + "k." * 1500 + "k = 1", "sweep." + "k." * 1500 + "k = [1]", "[[sweep]]",
    "[[cases.x]]", "[sweep.seed]", "[knobs.k1]", "[displacement.shift_mm.min]", "[store]",
    "= 1", "[", "'''", '"', "\ufeff", "sweep.seed = [1, 2, 3]", "cases.x.seed = 1",
    "sweep.cell = [1, '', '../cell']", "sweep.worlds = [" + "1, " * 3000 + "]",
)  # fmt: skip


def mutated(rng: random.Random, text: str) -> bytes:
    """The file with one or two mutations of its values, lines or bytes."""
    data = text.encode()
    for _ in range(rng.randint(1, 2)):
        data = rng.choice(_MUTATIONS)(rng, data)
    return data


# -- Bytes and lines ----------------------------------------------------------------------


def _flip_bytes(rng: random.Random, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        if changed:
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _cut(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _change_lines(rng: random.Random, data: bytes) -> bytes:
    lines = data.split(b"\n")
    at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            del lines[at]
        case 1:
            lines.insert(other, lines[at])
        case 2:
            lines[at], lines[other] = lines[other], lines[at]
        case _:
            lines.insert(at, rng.choice(_LINES).encode())
    return b"\n".join(lines)


def _swap_values(rng: random.Random, data: bytes) -> bytes:
    """Two values of the file change places."""
    lines = data.split(b"\n")
    with_values = [index for index, line in enumerate(lines) if b" = " in line]
    if len(with_values) > 1:
        one, two = rng.sample(with_values, 2)
        (key_1, value_1), (key_2, value_2) = (lines[i].split(b" = ", 1) for i in (one, two))
        lines[one], lines[two] = key_1 + b" = " + value_2, key_2 + b" = " + value_1
    return b"\n".join(lines)


# -- Values -----------------------------------------------------------------------------------


def _change_values(rng: random.Random, data: bytes) -> bytes:
    """Legal TOML again: keys and values anywhere in the file are replaced, added, taken away."""
    try:
        values = tomllib.loads(data.decode())
    except (ValueError, RecursionError):  # broken already
        return data
    for _ in range(rng.randint(1, 3)):
        _change_one(rng, rng.choice(_tables(values)))
    try:
        return tomli_w.dumps(values).encode()
    except (ValueError, RecursionError):
        return data


def _change_one(rng: random.Random, table: Table) -> None:
    key = rng.choice(list(table)) if table and rng.random() < 0.7 else rng.choice(_KEYS)
    match rng.randrange(6):
        case 0:
            table.pop(key, None)
        case 1:
            table[rng.choice(_KEYS)] = table.pop(key, 0)
        case 2:
            table[key] = [table[key]] if key in table else []
        case _:
            table[key] = _value(rng)


def _value(rng: random.Random, depth: int = 0) -> Any:
    kind = rng.random()
    if depth == 3 or kind < 0.6:
        return rng.choice(_SCALARS)
    if kind < 0.8:
        return [_value(rng, depth + 1) for _ in range(rng.randrange(4))]
    return {rng.choice(_KEYS): _value(rng, depth + 1) for _ in range(rng.randrange(3))}


def _tables(values: Table) -> list[Table]:
    """All tables of a file, its own first and thrice as likely as any other."""
    found, level = [values] * 3, [values]
    while level:
        level = [inner for table in level for inner in table.values() if isinstance(inner, dict)]
        found += level
    return found


# -- Cases ------------------------------------------------------------------------------------


def _change_cases(rng: random.Random, data: bytes) -> bytes:
    """Another sweep, case, ablation or isolation, mostly of keys that exist."""
    try:
        values = tomllib.loads(data.decode())
    except (ValueError, RecursionError):
        return data
    kind = rng.choice(["sweep", "cases", "ablate", "isolate"])
    if kind != "cases" or rng.random() < 0.5:
        for key in ("sweep", "cases", "ablate", "isolate") if rng.random() < 0.8 else ():
            values.pop(key, None)
    changes = {
        "seed": rng.choice([[1, 2], [3], list(range(rng.randrange(1200)))]),
        "worlds": [1, rng.choice(_SCALARS)],
        "profile": rng.sample(["paper", "ideal", "typical", "papr"], 2),
        "knobs": {rng.choice(list(Tolerances.model_fields)): [0, rng.choice([0.1, 0.4, 99, "x"])]},
        "displacement": {"turn_deg": {"max": [20, rng.choice(_SCALARS)]}},
        "cell": ["../cell", rng.choice(["", "nowhere", 3])],
        rng.choice(_KEYS): _value(rng),
    }
    chosen = dict(rng.sample(list(changes.items()), rng.randint(1, 3)))
    names = rng.sample([*SOURCES, *Tolerances.model_fields, "gravty"], rng.randrange(4))
    match kind:
        case "sweep":
            values["sweep"] = chosen
        case "cases":
            values["cases"] = {rng.choice(["a", "b c", "ü", "", "\n", "list"]): _firsts(chosen)}
        case _:
            values[kind] = rng.choice([names, "each source", "each", 3])
    try:
        return tomli_w.dumps(values).encode()
    except (ValueError, RecursionError):
        return data


def _firsts(changes: Table) -> Table:
    """One value of each list of a sweep."""
    return {
        key: _firsts(value) if isinstance(value, dict) else value[0]
        for key, value in changes.items()
        if isinstance(value, dict) or (isinstance(value, list) and value)
    }


_MUTATIONS: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    _flip_bytes, _cut, _change_lines, _change_lines, _swap_values, _change_values,
    _change_values, _change_values, _change_cases, _change_cases,
)  # fmt: skip
