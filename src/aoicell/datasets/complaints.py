"""What is wrong with a manifest, as one sentence: the path of the key, its value, what is legal.

The legal keys and choices are read from the model itself, so they cannot disagree with it.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError

from aoicell.errors import did_you_mean, shown

Models = Mapping[str, type[BaseModel]]


def explain(error: ValidationError, model: type[BaseModel], tags: Models) -> str:
    """The most telling complaint of several: a misspelt key explains a missing one.

    `tags` are the members of unions by the names that pydantic puts into the path of a key.
    """
    complaints = error.errors()
    first = next((c for c in complaints if c["type"] == "extra_forbidden"), complaints[0])
    keys, legal, choices = _walk(first["loc"], model, tags)
    kind, value = first["type"], first["input"]
    if kind in ("model_type", "model_attributes_type") and not isinstance(value, dict):
        return f"'{'.'.join(keys)}' = {shown(value)}: give a table"
    if kind.startswith("union_tag"):  # a table whose 'kind' is missing or unknown
        keys, value = [*keys, "kind"], value.get("kind")
        kind = "missing" if value is None else "literal_error"
    where = ".".join(keys)
    if kind == "extra_forbidden":
        return f"unknown key '{where}'; {did_you_mean(keys[-1], legal)}"
    if kind == "missing":
        hint = f"; nothing is guessed: give one of {_listed(choices)}" if choices else ""
        return f"key '{where}' is missing{hint}"
    if kind == "literal_error":
        close = did_you_mean(value if isinstance(value, str) else shown(value), choices)
        # of two opposites the one that is spelt alike is no better a guess
        hint = f"{close} " if close.startswith("did") and len(choices) > 2 else ""
        return f"'{where}' = {shown(value)}: {hint}give one of {_listed(choices)}"
    message = str(first["msg"]).removeprefix("Value error, ")
    if kind == "value_error" and (not where or message.startswith(("'", "key '"))):
        return message  # names its key itself
    given = "" if isinstance(value, dict) else f" = {shown(value)}"
    return f"'{where}'{given}: {message[:1].lower()}{message[1:]}"


def _walk(
    place: Sequence[int | str], model: type[BaseModel], tags: Models
) -> tuple[list[str], list[str], list[str]]:
    """The keys of a place without tags, the legal keys around the last, its legal values."""
    keys: list[str] = []
    models, around = [model], [model]
    choices: list[str] = []
    for part in place:
        if isinstance(part, str) and len(models) > 1 and tags.get(part) in models:
            models = [tags[part]]
            choices = []
            continue
        keys.append(str(part))
        if isinstance(part, int):
            continue
        around = models
        types = [m.model_fields[part].annotation for m in around if part in m.model_fields]
        models = [found for kind in types for found in _models(kind)]
        choices = list(dict.fromkeys(c for kind in types for c in _choices(kind)))
    if not choices and len(models) > 1:  # a union: its members tell themselves apart by their tags
        choices = [tag for tag, member in tags.items() if member in models]
    return keys, sorted({key for m in around for key in m.model_fields}), choices


def _models(annotation: Any) -> list[type[BaseModel]]:
    """The models within a type."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in get_args(annotation) for found in _models(part)]


def _choices(annotation: Any) -> list[str]:
    """The closed list within a type."""
    if get_origin(annotation) is Literal:
        return list(get_args(annotation))
    if _models(annotation):
        return []
    return [choice for part in get_args(annotation) for choice in _choices(part)]


def _listed(choices: Sequence[str]) -> str:
    return ", ".join(map(repr, choices))
