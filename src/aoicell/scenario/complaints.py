"""What is wrong with a typed file, as one sentence: the path of the key, its value, what is legal.

The legal values are read from the model's own JSON schema, so they cannot disagree with it.
"""

import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from pydantic import BaseModel, ValidationError

from aoicell.errors import did_you_mean, shown

Schema = Mapping[str, Any]

_NUMBERS = {"integer": "an integer", "number": "a number"}


def explain(error: ValidationError, model: type[BaseModel], under: str = "") -> str:
    """The most telling complaint as one sentence, with a hint for a misspelt key.

    `under` is the path at which `model` stands in the file. A validator of the whole model
    names its keys itself.
    """
    complaints = error.errors(include_url=False)
    first = next((c for c in complaints if c["type"] == "extra_forbidden"), complaints[0])
    *outer, last = first["loc"] or ("",)
    if first["type"] == "extra_forbidden":
        place, nodes = _walk(model, outer)
        where = dotted([*place, last], under)
        return f"unknown key '{where}'; {did_you_mean(str(last), _keys(nodes))}"
    place, nodes = _walk(model, first["loc"])
    where = dotted(place, under)
    if first["type"] == "missing":
        return f"key '{where}' is missing; give {_legal(nodes)}"
    by_rule = first["type"] in ("value_error", "assertion_error")
    message = str(first["ctx"]["error"]) if by_rule else f"give {_legal(nodes)}"
    if place:
        return f"'{where}' = {shown(first['input'])}: {message}"
    return f"'{under}': {message}" if under else message


def dotted(place: Sequence[int | str], under: str = "") -> str:
    """A path of keys as TOML writes it, in quotes where a key needs them."""
    keys = [
        str(key) if re.fullmatch(r"[A-Za-z0-9_-]+", str(key)) else json.dumps(key) for key in place
    ]
    return ".".join([under, *keys] if under else keys)


def _walk(
    model: type[BaseModel], place: Sequence[int | str]
) -> tuple[list[int | str], list[Schema]]:
    """A place without pydantic's names for the members of unions, and what may stand there.

    Several parts of the JSON schema belong to the place of a union.
    """
    schema = _schema(model)
    keys, nodes = [], _branches(schema, schema)
    for part in place:
        children = [child for node in nodes if (child := _child(node, part)) is not None]
        if children:
            keys.append(part)
            nodes = [branch for child in children for branch in _branches(schema, child)]
    return keys, nodes


@cache
def _schema(model: type[BaseModel]) -> Schema:
    return model.model_json_schema()


def _child(node: Schema, part: int | str) -> Schema | None:
    if isinstance(part, int):
        child = node.get("items")
    else:
        child = node.get("properties", {}).get(part, node.get("additionalProperties"))
    return child if isinstance(child, Mapping) else None


def _branches(schema: Schema, node: Schema) -> list[Schema]:
    """The members of a union, or the node itself."""
    node = _resolve(schema, node)
    members = node.get("anyOf") or node.get("oneOf") or [node]
    return [_resolve(schema, member) for member in members]


def _resolve(schema: Schema, node: Schema) -> Schema:
    if "$ref" not in node:
        return node
    resolved: Schema = schema["$defs"][str(node["$ref"]).rsplit("/", 1)[-1]]
    return resolved


def _keys(nodes: Sequence[Schema]) -> set[str]:
    return {key for node in nodes for key in node.get("properties", {})}


def _legal(nodes: Sequence[Schema]) -> str:
    return " or ".join(_words(node) for node in nodes)


def _words(node: Schema) -> str:
    """What one part of a schema takes: the range of a number, the choices, the keys of a table."""
    kind = node.get("type")
    if "enum" in node:
        return "one of " + ", ".join(repr(choice) for choice in node["enum"])
    if "const" in node:
        return repr(node["const"])
    if kind in _NUMBERS:
        return f"{_NUMBERS[kind]} from {_figure(node['minimum'])} to {_figure(node['maximum'])}"
    if kind == "boolean":
        return "true or false"
    if kind == "string":
        return f"a text of {node['description']}" if "pattern" in node else "a text"
    if kind == "array":
        return "a list of at least one value" if node.get("minItems") else "a list"
    keys = list(node.get("properties", {}))
    return (
        "{ " + ", ".join(f"{key} = ..." for key in keys) + " }" if 0 < len(keys) < 6 else "a table"
    )


def _figure(number: float) -> str:
    return str(number) if isinstance(number, int) else f"{number:g}"
