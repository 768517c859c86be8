"""What the tables of a scenario file have in common."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Strict(BaseModel):
    """A frozen table: no key that it does not know, no value of another type."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def within(low: float, high: float) -> Any:
    """The field of a finite number from `low` to `high`."""
    return Field(ge=low, le=high, allow_inf_nan=False)


def list_or_other(value: Any) -> str:
    """Which member of a union a value is meant for: a complaint is then about that one."""
    return "list" if isinstance(value, list) else "other"
