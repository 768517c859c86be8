"""What a scenario file may say: one experiment.

Every key is checked; `load_scenario` turns a complaint into one sentence.
"""

from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    WithJsonSchema,
    model_validator,
)

from aoicell.errors import InputError, ScenarioError, did_you_mean
from aoicell.methods import method_names
from aoicell.nominal import Nominal
from aoicell.resources import data_root
from aoicell.sim.adversity import CAUSES
from aoicell.sim.profiles import PROFILES
from aoicell.sim.sources import SOURCES
from aoicell.sim.tolerances import Tolerances
from aoicell.targets.marker import MARKERS, marker_kinds


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def _within(low: float, high: float) -> Any:
    return Field(ge=low, le=high, allow_inf_nan=False)


# -- Names and lists of them ------------------------------------------------------------


def _known(known: Collection[str]) -> AfterValidator:
    def check(name: str) -> str:
        if name not in known:
            raise ValueError(did_you_mean(name, known))
        return name

    return AfterValidator(check)


def _choice(known: Collection[str]) -> WithJsonSchema:
    """What editors offer, and what a complaint lists."""
    return WithJsonSchema({"type": "string", "enum": list(known)})


def _each_once(names: list[str]) -> list[str]:
    for index, name in enumerate(names):
        if name in names[:index]:
            raise ValueError(f"'{name}' stands there twice; name each once")
    return names


_SOURCES_AND_KNOBS = {**SOURCES, **Tolerances.model_fields}

Profile = Annotated[str, _known(PROFILES), _choice(PROFILES)]
MethodName = Annotated[str, _known(method_names()), _choice(method_names())]
CauseName = Annotated[str, _known(CAUSES), _choice(CAUSES)]
SourceName = Annotated[str, _known(_SOURCES_AND_KNOBS), _choice(_SOURCES_AND_KNOBS)]


def _list_or_other(value: Any) -> str:
    """Which member of a union a value is meant for: a complaint is then about that one."""
    return "list" if isinstance(value, list) else "other"


Sources = Annotated[
    Annotated[list[SourceName], AfterValidator(_each_once), Tag("list")]
    | Annotated[Literal["each source"], Tag("other")],
    Discriminator(_list_or_other),
]


# -- How the board is moved -------------------------------------------------------------


class Range(_Strict):
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

    min: float = _within(0, 300)
    max: float = _within(0, 300)


class TurnRange(Range):
    """Angles about the normal, deg."""

    min: float = _within(-180, 180)
    max: float = _within(-180, 180)


class LiftRange(Range):
    """Heights over the table, mm."""

    min: float = _within(-50, 50)
    max: float = _within(-50, 50)


class TiltRange(Range):
    """Angles about a line in the table, deg."""

    min: float = _within(-45, 45)
    max: float = _within(-45, 45)


Shifts = Annotated[
    Annotated[list[Annotated[float, _within(0, 300)]], Field(min_length=1), Tag("list")]
    | Annotated[ShiftRange, Tag("other")],
    Discriminator(_list_or_other),
]


class Displacement(_Strict):
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


# -- The markers ------------------------------------------------------------------------


def _known_kind(kind: str) -> str:
    if kind and kind not in marker_kinds():
        raise ValueError(did_you_mean(kind, marker_kinds()))
    return kind


MarkerName = Annotated[str, AfterValidator(_known_kind), _choice(["", *MARKERS])]


class MarkerChoice(_Strict):
    """The board's markers; "" and 0 leave what the cell's board has.

    A size that is not given is the board's own or what the pitch needs. The markers stay where the
    board has them; one that would leave its outline moves inwards. `make_room` leaves out the
    components that a larger marker would lie on.
    """

    kind: MarkerName = ""
    size_mm: float = Field(default=0.0, ge=0, le=300, allow_inf_nan=False)
    pitch_mm: float = Field(default=0.0, ge=0, le=300, allow_inf_nan=False)
    make_room: bool = False


# -- The experiment ---------------------------------------------------------------------


class Store(_Strict):
    """What a run keeps beside its numbers."""

    images: bool = False


def _legal_knobs(knobs: Any) -> Any:
    Tolerances.model_validate(knobs, strict=True)
    return knobs


Knobs = Annotated[
    dict[str, float],
    BeforeValidator(_legal_knobs),
    WithJsonSchema(
        {
            "type": "object",
            "description": "Single error sources, in place of what the profile says.",
            "properties": Tolerances.model_json_schema()["properties"],
            "additionalProperties": False,
        }
    ),
]

_DEEPEST = 6  # tables and lists in each other: more than any key of a scenario needs


def _shallow(changes: dict[str, Any]) -> dict[str, Any]:
    level: list[Any] = [changes]
    for _ in range(_DEEPEST):
        tables = [value.values() if isinstance(value, dict) else value for value in level]
        level = [v for table in tables for v in table if isinstance(v, dict | list)]
    if level:
        raise ValueError("no key of a scenario lies that deep")
    return changes


def _printable(cases: dict[str, Any]) -> dict[str, Any]:
    for name in cases:
        if not (name.strip() and name.isprintable()):
            raise ValueError(f"the name {name!r} of a case cannot be printed; give it letters")
    return cases


Changes = Annotated[dict[str, Any], AfterValidator(_shallow)]  # nested like the scenario itself


class Scenario(_Strict):
    """One experiment.

    `colour` gives the cell colour cameras instead of grey ones, with noise in each channel.
    Without `pictures` nothing is rendered: target points are projected from the truth, with
    the detection noise that was measured in pictures. Without `visit` a trial ends with the
    corrected views: nobody looks at them, and they are scored from the truth alone. `inject` then
    names what goes wrong, one cause a trial and each equally often ("none" is one of them).

    A scenario may stand for several cases, all with the same draws: `sweep` gives lists of
    values for any keys (all combinations), `cases` names changes of several keys, `ablate`
    switches error sources off one by one and `isolate` leaves one alone; both take names of
    sources or knobs, or "each source".
    """

    name: Annotated[
        str, Field(pattern=r"^[A-Za-z0-9_\-]+$", description="letters, digits, '_' and '-'")
    ]
    title: str = ""
    cell: str = ""
    profile: Profile = "typical"
    seed: Annotated[int, Field(ge=0, le=2**32 - 1)] = 0
    worlds: Annotated[int, Field(ge=1, le=10_000)] = 1
    trials_per_world: Annotated[int, Field(ge=1, le=100_000)] = 2
    methods: Annotated[list[MethodName], Field(min_length=1), AfterValidator(_each_once)] = [
        "paper",
        "aoicell_one_look",
        "aoicell",
    ]
    pictures: bool = True
    visit: bool = True
    inject: Annotated[list[CauseName], AfterValidator(_each_once)] = []
    colour: bool = False
    tolerance_mm: Annotated[float, _within(1e-3, 1e3)] = 5.0
    displacement: Displacement = Displacement()
    marker: MarkerChoice = MarkerChoice()
    knobs: Knobs = {}
    store: Store = Store()
    sweep: Changes = {}
    cases: Annotated[dict[str, Changes], AfterValidator(_printable)] = {}
    ablate: Sources = []
    isolate: Sources = []

    @model_validator(mode="after")
    def _one_shift_a_trial(self) -> "Scenario":
        shifts = self.displacement.shift_mm
        if isinstance(shifts, list) and len(shifts) != self.trials_per_world:
            raise ValueError(
                f"'displacement.shift_mm' lists {len(shifts)} distances for "
                f"trials_per_world = {self.trials_per_world}; give one a trial, or a range"
            )
        return self

    @model_validator(mode="after")
    def _pictured(self) -> "Scenario":
        if "markerless" in self.methods and not self.pictures:
            raise ValueError("method 'markerless' looks at texture: it goes with pictures = true")
        return self

    @model_validator(mode="after")
    def _injectable(self) -> "Scenario":
        if self.inject and (self.visit or not self.pictures):
            raise ValueError("'inject' goes with visit = false and pictures = true")
        return self

    @property
    def tolerances(self) -> Tolerances:
        """The profile with the scenario's own knobs."""
        return Tolerances(**{**PROFILES[self.profile].model_dump(), **self.knobs})

    @property
    def cell_folder(self) -> Path:
        """The cell's folder; the shipped one when the scenario names none."""
        return Path(self.cell) if self.cell else data_root() / "cell"

    def fitted(self, nominal: Nominal) -> Nominal:
        """The cell with the scenario's markers. Raises ScenarioError where they do not fit."""
        marker = self.marker
        if marker == MarkerChoice():
            return nominal
        size, pitch = marker.size_mm / 1e3, marker.pitch_mm / 1e3
        try:
            return nominal.with_markers(marker.kind, size, pitch, marker.make_room)
        except InputError as error:
            raise ScenarioError(f"'marker': {error}") from None

    @property
    def trials(self) -> int:
        """Number of trials in all worlds of one case."""
        return self.worlds * self.trials_per_world

    def to_toml(self) -> str:
        """The resolved scenario, as a file that reads back the same."""
        return tomli_w.dumps(self.model_dump())
