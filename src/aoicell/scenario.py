"""A scenario file: one experiment, as typed TOML.

Every key is checked; a complaint names the file, the path of the key, the value and what
would be legal.
"""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

from aoicell.errors import ScenarioError, did_you_mean
from aoicell.resources import data_root
from aoicell.sim.profiles import PROFILES
from aoicell.sim.tolerances import Tolerances

MethodName = Literal["paper", "aoicell"]


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def _within(low: float, high: float) -> Any:
    return Field(ge=low, le=high, allow_inf_nan=False)


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


def _list_or_range(value: Any) -> str | None:
    if isinstance(value, list):
        return "list"
    return "range" if isinstance(value, dict | Range) else None


Shifts = Annotated[
    Annotated[list[Annotated[float, _within(0, 300)]], Field(min_length=1), Tag("list")]
    | Annotated[ShiftRange, Tag("range")],
    Discriminator(
        _list_or_range,
        custom_error_type="shifts",
        custom_error_message="give a list with one distance a trial, or { min = ..., max = ... }",
    ),
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


class Store(_Strict):
    """What a run keeps beside its numbers."""

    images: bool = False


class Scenario(_Strict):
    """One experiment.

    `colour` gives the cell colour cameras instead of grey ones, with noise in each channel.
    Without `pictures` nothing is rendered: target points are projected from the truth, with
    the detection noise that was measured in pictures.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_\-]+$")]
    title: str = ""
    cell: str = ""
    profile: str = "typical"
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    worlds: Annotated[int, Field(ge=1, le=10_000)] = 1
    trials_per_world: Annotated[int, Field(ge=1, le=100_000)] = 2
    methods: Annotated[list[MethodName], Field(min_length=1)] = ["paper", "aoicell"]
    pictures: bool = True
    colour: bool = False
    tolerance_mm: Annotated[float, _within(1e-3, 1e3)] = 5.0
    displacement: Displacement = Displacement()
    knobs: dict[str, float] = {}
    store: Store = Store()

    @model_validator(mode="after")
    def _known(self) -> "Scenario":
        if self.profile not in PROFILES:
            raise ValueError(f"profile '{self.profile}': {did_you_mean(self.profile, PROFILES)}")
        for name in self.knobs:
            if name not in Tolerances.model_fields:
                raise ValueError(f"knobs.{name}: {did_you_mean(name, Tolerances.model_fields)}")
        if len(set(self.methods)) < len(self.methods):
            raise ValueError(f"methods = {self.methods} names a method twice; each may stand once")
        shifts = self.displacement.shift_mm
        if isinstance(shifts, list) and len(shifts) != self.trials_per_world:
            raise ValueError(
                f"displacement.shift_mm lists {len(shifts)} distances for "
                f"trials_per_world = {self.trials_per_world}; give one a trial, or a range"
            )
        _tolerances(self)
        return self

    @property
    def tolerances(self) -> Tolerances:
        """The profile with the scenario's own knobs."""
        return _tolerances(self)

    @property
    def cell_folder(self) -> Path:
        """The cell's folder; the shipped one when the scenario names none."""
        return Path(self.cell) if self.cell else data_root() / "cell"

    @property
    def trials(self) -> int:
        """Number of trials in all worlds."""
        return self.worlds * self.trials_per_world

    def to_toml(self) -> str:
        """The resolved scenario, as a file that reads back the same."""
        return tomli_w.dumps(self.model_dump())


def _tolerances(scenario: Scenario) -> Tolerances:
    profile = PROFILES[scenario.profile].model_dump()
    try:
        return Tolerances(**{**profile, **scenario.knobs})
    except ValidationError as error:
        first = error.errors()[0]
        knob, message = first["loc"][0], _plain(str(first["msg"]))
        raise ValueError(f"'knobs.{knob}' = {first['input']!r}: {message}") from None


def load_scenario(path: Path, **overrides: Any) -> Scenario:
    """Read and check a scenario; `overrides` that are not None replace its keys.

    `cell` may be a path relative to the file. Raises ScenarioError.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError:
        raise ScenarioError(f"{path}: no such scenario file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: not valid TOML ({error})") from None
    values |= {key: value for key, value in overrides.items() if value is not None}
    if isinstance(values.get("cell"), str) and values["cell"]:
        values["cell"] = str(_cell_folder(path, values["cell"]))
    try:
        return Scenario(**values)
    except ValidationError as error:
        raise ScenarioError(f"{path}: {_explain(error)}") from None


def _cell_folder(path: Path, cell: str) -> Path:
    folder = (path.parent / cell).resolve()
    if not (folder / "nominal.toml").is_file():
        raise ScenarioError(
            f"{path}: 'cell' = {cell!r}: there is no nominal.toml in {folder}; "
            "name a cell's folder, relative to the scenario file"
        )
    return folder


def _explain(error: ValidationError) -> str:
    """The most telling complaint as one sentence, with a hint for a misspelt key."""
    complaints = error.errors()
    first = next((c for c in complaints if c["type"] == "extra_forbidden"), complaints[0])
    place = [part for part in first["loc"] if part not in ("list", "range")]  # tags, no keys
    where = ".".join(str(part) for part in place)
    if first["type"] == "extra_forbidden":
        return f"unknown key '{where}'; {did_you_mean(str(place[-1]), _keys(place))}"
    if first["type"] == "missing":
        return f"key '{where}' is missing"
    message = _plain(str(first["msg"]))
    return f"'{where}' = {first['input']!r}: {message}" if where else message


def _plain(message: str) -> str:
    message = message.removeprefix("Value error, ")
    return message if message[:2].isupper() else message[:1].lower() + message[1:]


def _keys(place: Sequence[int | str]) -> list[str]:
    """The legal keys at the place of a misspelt one."""
    model: type[BaseModel] = Scenario
    for part in place[:-1]:
        field = model.model_fields.get(str(part))
        kind = field.annotation if field else None
        is_model = isinstance(kind, type) and issubclass(kind, BaseModel)
        model = kind if is_model else Range  # type: ignore[assignment]
    return list(model.model_fields)
