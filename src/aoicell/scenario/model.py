"""What a scenario file may say: one experiment.

Every key is checked; `load_scenario` turns a complaint into one sentence.
"""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    WithJsonSchema,
    model_validator,
)

from aoicell.errors import InputError, ScenarioError, did_you_mean
from aoicell.methods import method_names
from aoicell.nominal import Nominal, load_views
from aoicell.resources import data_root
from aoicell.scenario.displacement import Displacement
from aoicell.scenario.strict import Strict, list_or_other, within
from aoicell.sim.adversity import CAUSES
from aoicell.sim.defects import DEFECT_KINDS
from aoicell.sim.profiles import PROFILES
from aoicell.sim.sources import SOURCES
from aoicell.sim.tolerances import Tolerances
from aoicell.targets.marker import MARKERS, marker_kinds

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
DefectKind = Annotated[str, _known(DEFECT_KINDS), _choice(DEFECT_KINDS)]
CauseName = Annotated[str, _known(CAUSES), _choice(CAUSES)]
SourceName = Annotated[str, _known(_SOURCES_AND_KNOBS), _choice(_SOURCES_AND_KNOBS)]


Sources = Annotated[
    Annotated[list[SourceName], AfterValidator(_each_once), Tag("list")]
    | Annotated[Literal["each source"], Tag("other")],
    Discriminator(list_or_other),
]


# -- The markers ------------------------------------------------------------------------


def _known_kind(kind: str) -> str:
    if kind and kind not in marker_kinds():
        raise ValueError(did_you_mean(kind, marker_kinds()))
    return kind


MarkerName = Annotated[str, AfterValidator(_known_kind), _choice(["", *MARKERS])]


class MarkerChoice(Strict):
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


class Inspection(Strict):
    """What `inspect` inspects: boards with so many `defects` of these `kinds` each.

    They are compared with `golden_samples` good boards, photographed when the board is taught, or
    with the `virtual` image of the board as designed.
    """

    defects: Annotated[int, Field(ge=0, le=100)] = 10
    kinds: Annotated[list[DefectKind], Field(min_length=1), AfterValidator(_each_once)] = list(
        DEFECT_KINDS
    )
    reference: Literal["golden", "virtual"] = "golden"
    golden_samples: Annotated[int, Field(ge=1, le=10)] = 1


class Store(Strict):
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


class Scenario(Strict):
    """One experiment.

    `colour` gives the cell colour cameras instead of grey ones, with noise in each channel.
    Without `pictures` nothing is rendered: target points are projected from the truth, with
    the detection noise that was measured in pictures. Without `visit` a trial ends with the
    corrected views: nobody looks at them, and they are scored from the truth alone. `inject` then
    names what goes wrong, one cause a trial and each equally often ("none" is one of them).

    `views` is a file of inspection views ("": those of the cell's board). With `inspect` defects
    are planted on each board, and what is photographed is inspected for them.

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
    views: str = ""
    inspect: bool = False
    inspection: Inspection = Inspection()
    inject: Annotated[list[CauseName], AfterValidator(_each_once)] = []
    colour: bool = False
    tolerance_mm: Annotated[float, within(1e-3, 1e3)] = 5.0
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

    @model_validator(mode="after")
    def _inspectable(self) -> "Scenario":
        if self.inspect and not (self.visit and self.pictures):
            raise ValueError("'inspect' goes with visit = true and pictures = true")
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
        """The cell with the scenario's views and markers.

        Raises ScenarioError where the markers do not fit, and ModelError for what is wrong with
        the file of views.
        """
        if self.views:
            nominal = replace(nominal, inspection_views=load_views(Path(self.views)))
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
