"""How the board is moved: the distributions that a scenario gives."""

from typing import Annotated

from pydantic import Discriminator, Field, Tag, model_validator

from aoicell.scenario.strict import Strict, list_or_other, within


class Range(Strict):
    """A uniform distribution from `min` to `max`."""

    min: float
    max: float

    @model_validator(mode="after")
    def _ordered(self) -> "Range":
        if self.max < self.min:
            raise ValueError(f"max ({self.max}) is below min ({self.min})")
        return self


class ShiftRange(Range):
    """Distances in the plane of the table, mm."""

    min: float = within(0, 300)
    max: float = within(0, 300)


class TurnRange(Range):
    """Angles about the normal, deg."""

    min: float = within(-180, 180)
    max: float = within(-180, 180)


class LiftRange(Range):
    """Heights over the table, mm."""

    min: float = within(-50, 50)
    max: float = within(-50, 50)


class TiltRange(Range):
    """Angles about a line in the table, deg."""

    min: float = within(-45, 45)
    max: float = within(-45, 45)


Shifts = Annotated[
    Annotated[list[Annotated[float, within(0, 300)]], Field(min_length=1), Tag("list")]
    | Annotated[ShiftRange, Tag("other")],
    Discriminator(list_or_other),
]


class Displacement(Strict):
    """How the board is moved in each trial, about the positioning marker.

    `shift_mm` is a list with one distance a trial, or a range; the direction in the table's
    plane is drawn. `turn_deg` is about the normal; `lift_mm` and `tilt_deg` lead out of plane.
    """

    shift_mm: Shifts = ShiftRange(min=20, max=60)
    turn_deg: TurnRange = TurnRange(min=-15, max=15)
    lift_mm: LiftRange = LiftRange(min=0, max=0)
    tilt_deg: TiltRange = TiltRange(min=0, max=0)

    @model_validator(mode="after")
    def _possible(self) -> "Displacement":
        least = self.shift_mm.min if isinstance(self.shift_mm, Range) else min(self.shift_mm)
        if max(abs(self.lift_mm.min), abs(self.lift_mm.max)) > least:
            raise ValueError(f"lift_mm exceeds the smallest shift_mm ({least}), which contains it")
        return self
