"""The cases that one scenario stands for: a sweep over keys, named changes, sources off or alone.

All cases share the scenario's seed, so what differs between them is what was changed.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any, Literal

from pydantic import ValidationError

from aoicell.errors import ScenarioError, shown
from aoicell.scenario.complaints import dotted, explain
from aoicell.scenario.model import Scenario
from aoicell.sim.sources import SOURCES, is_on, knobs_of, only

Kind = Literal["as it stands", "sweep", "named", "without", "alone"]
Path = tuple[str, ...]  # of a key
Named = tuple[Kind, str, Scenario]

_SEVERAL = ("sweep", "cases", "ablate", "isolate")  # the keys that make cases
_ONE_FOR_ALL = (*_SEVERAL, "name", "methods", "store")
_MOST = 1000


@dataclass(frozen=True)
class Case:
    """One resolved scenario among those that a file stands for, and what sets it apart."""

    index: int
    kind: Kind
    label: str
    scenario: Scenario


def cases_of(scenario: Scenario) -> list[Case]:
    """All cases: of a sweep every combination, the last key fastest; else the scenario as it
    stands, then named changes, sources alone and all but each, in the file's order.

    Raises ScenarioError for a change that makes no legal scenario.
    """
    used = [key for key in _SEVERAL if getattr(scenario, key)]
    if "sweep" in used and len(used) > 1:
        raise ScenarioError(f"'sweep' and '{used[1]}' cannot stand together; make two files of it")
    plain = scenario.model_copy(update={"sweep": {}, "cases": {}, "ablate": [], "isolate": []})
    found = _swept(plain, scenario.sweep) if "sweep" in used else _others(plain, scenario)
    return [Case(index, *case) for index, case in enumerate(found)]


def _others(plain: Scenario, scenario: Scenario) -> Iterator[Named]:
    _check_count(len(scenario.cases), "cases")
    yield "as it stands", "", plain
    for name, change in scenario.cases.items():
        yield "named", name, _changed(plain, change, dotted(["cases", name]))
    profile = plain.tolerances
    for source in _sources(plain, "isolate", scenario.isolate):
        own = only(profile, source).model_dump(exclude_defaults=True)
        yield "alone", source, plain.model_copy(update={"profile": "ideal", "knobs": own})
    for source in _sources(plain, "ablate", scenario.ablate):
        off = {**plain.knobs, **dict.fromkeys(knobs_of(source), 0.0)}
        yield "without", source, plain.model_copy(update={"knobs": off})


def _sources(plain: Scenario, key: str, names: Sequence[str]) -> list[str]:
    """The sources that are named, or each that is on. Raises ScenarioError for one that is off."""
    profile = plain.tolerances
    if isinstance(names, str):
        return [source for source in SOURCES if is_on(profile, source)]
    for index, name in enumerate(names):
        if not is_on(profile, name):
            raise ScenarioError(
                f"'{key}.{index}' = '{name}': it is off in profile '{plain.profile}' with this "
                "scenario's knobs; name a source that is on"
            )
    return list(names)


# -- Sweeps -----------------------------------------------------------------------------


def _swept(plain: Scenario, sweep: Mapping[str, Any]) -> Iterator[Named]:
    """Every combination of the values that a sweep lists."""
    _refuse_common(sweep, "sweep")
    axes = dict(_axes(sweep))
    _check_count(prod(len(values) for values in axes.values()), "sweep")
    _refuse_twice(axes)
    last_names = [path[-1] for path in axes]
    unlike = len(set(last_names)) == len(last_names)
    names = last_names if unlike else [dotted(path) for path in axes]
    words = [_words(path, values) for path, values in axes.items()]
    for chosen, texts in zip(product(*axes.values()), product(*words), strict=True):
        label = ", ".join(f"{name} = {text}" for name, text in zip(names, texts, strict=True))
        change: dict[str, Any] = {}
        for path, value in zip(axes, chosen, strict=True):
            _put(change, path, value)
        try:
            yield "sweep", label, _changed(plain, change, "sweep")
        except ScenarioError as error:
            raise ScenarioError(f"{error} (in the case {shown(label)})") from None


def _axes(sweep: Mapping[str, Any], under: Path = ()) -> Iterator[tuple[Path, list[Any]]]:
    """Paths of keys and their lists of values. Raises ScenarioError where there is no list."""
    for key, value in sweep.items():
        path = (*under, key)
        if isinstance(value, Mapping) and value:
            yield from _axes(value, path)
        elif isinstance(value, list) and value:
            yield path, value
        else:
            where = dotted(["sweep", *path])
            raise ScenarioError(f"'{where}' = {shown(value)}: give a list of at least one value")


def _refuse_twice(axes: Mapping[Path, list[Any]]) -> None:
    for path, values in axes.items():
        for index, value in enumerate(values):
            if value in values[:index]:
                where = dotted(["sweep", *path, index])
                raise ScenarioError(f"'{where}' = {shown(value)}: it stands there twice")


def _put(change: dict[str, Any], path: Path, value: Any) -> None:
    for key in path[:-1]:
        change = change.setdefault(key, {})
    change[path[-1]] = value


def _words(path: Path, values: Sequence[Any]) -> list[str]:
    """How the values of an axis are called in labels: folders by what tells them apart."""
    folders = [value for value in values if isinstance(value, str) and os.path.isabs(value)]
    if path != ("cell",) or not folders:
        return [_word(value) for value in values]
    common = os.path.commonpath([os.path.dirname(folder) for folder in folders])
    return [
        os.path.relpath(value, common) if value in folders else _word(value) for value in values
    ]


def _word(value: Any) -> str:
    if isinstance(value, Mapping) and set(value) == {"min", "max"}:
        low, high = value["min"], value["max"]
        return _word(low) if low == high else f"{_word(low)} to {_word(high)}"
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) and value.isprintable() else shown(value, 10_000)


# -- Changes ----------------------------------------------------------------------------


def _changed(plain: Scenario, change: Mapping[str, Any], where: str) -> Scenario:
    """The scenario with some keys changed. Raises ScenarioError."""
    _refuse_common(change, where)
    try:
        return Scenario(**_merged(plain.model_dump(), change))
    except ValidationError as error:
        raise ScenarioError(explain(error, Scenario, where)) from None


def _merged(values: Mapping[str, Any], change: Mapping[str, Any]) -> dict[str, Any]:
    """`values` with those of `change` put in their place; tables are merged key by key."""
    merged = dict(values)
    for key, new in change.items():
        old = merged.get(key)
        both = isinstance(old, Mapping) and isinstance(new, Mapping)
        merged[key] = _merged(old, new) if both else new  # type: ignore[arg-type]
    return merged


def _refuse_common(change: Mapping[str, Any], where: str) -> None:
    for key in change:
        if key in _ONE_FOR_ALL:
            raise ScenarioError(f"'{where}.{key}': '{key}' is one for all cases; leave it out here")


def _check_count(count: int, key: str) -> None:
    if count > _MOST:
        raise ScenarioError(f"'{key}' makes {count} cases; at most {_MOST} are accepted")
