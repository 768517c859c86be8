"""Profiles: what is legal, what is refused, and that the message names the knob."""

import math

import pytest
from pydantic import ValidationError

from aoicell.sim.profiles import IDEAL, PAPER, PROFILES, SOURCES
from aoicell.sim.tolerances import Tolerances

SIGNED = {"mount_bias_x_mm", "mount_bias_z_mm", "k1"}
KNOBS = list(Tolerances.model_fields)
UNITS = (
    "_deg", "_mm", "_um", "_ms", "_percent", "_ppm", "_px", "_grey", "_kelvin", "_bits",
    "_deg_per_kNm",
)  # fmt: skip
WITHOUT_UNIT = {"k1", "k1_sigma", "k2_sigma", "tangential_sigma", "shadows", "glare"}


def complaint(values: dict[str, object]) -> str:
    with pytest.raises(ValidationError) as caught:
        Tolerances.model_validate(values)
    (error,) = caught.value.errors()
    return ".".join(str(part) for part in error["loc"])


@pytest.mark.parametrize("knob", [knob for knob in KNOBS if knob not in SIGNED])
def test_a_negative_spread_is_refused_by_name(knob: str) -> None:
    assert complaint({knob: -1e-3}) == knob


@pytest.mark.parametrize("knob", KNOBS)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e6, "much"])
def test_nonsense_is_refused_by_name(knob: str, value: object) -> None:
    assert complaint({knob: value}) == knob


def test_an_unknown_knob_is_refused_by_name() -> None:
    assert complaint({"joint_zer0_deg": 0.1}) == "joint_zer0_deg"


@pytest.mark.parametrize("knob", sorted(SIGNED))
def test_what_has_a_sign_may_be_negative(knob: str) -> None:
    assert getattr(Tolerances.model_validate({knob: -0.1}), knob) == -0.1


def test_a_profile_cannot_be_altered() -> None:
    with pytest.raises(ValidationError):
        IDEAL.mount_mm = 1.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        PROFILES["ideal"] = PAPER  # type: ignore[index]
    with pytest.raises(TypeError):
        SOURCES["ideal"] = SOURCES["paper"]  # type: ignore[index]


def test_ideal_is_exact() -> None:
    assert set(IDEAL.model_dump().values()) == {0.0}


def test_paper_holds_what_the_paper_states() -> None:
    assert (PAPER.mount_bias_x_mm, PAPER.mount_bias_z_mm) == (9.0, 2.0)


@pytest.mark.parametrize("knob", KNOBS)
def test_every_knob_says_what_it_is_and_in_which_unit(knob: str) -> None:
    assert Tolerances.model_fields[knob].description
    assert knob.endswith(UNITS) or knob in WITHOUT_UNIT


@pytest.mark.parametrize("knob", KNOBS)
def test_every_knob_states_its_distribution(knob: str) -> None:
    extra = Tolerances.model_fields[knob].json_schema_extra
    assert isinstance(extra, dict)
    assert str(extra["distribution"]).partition(",")[0] in ("normal", "fixed")


@pytest.mark.parametrize("knob", KNOBS)
def test_the_legal_range_ends_where_it_says(knob: str) -> None:
    schema = Tolerances.model_json_schema()["properties"][knob]
    for end, beyond in (("minimum", -1e-6), ("maximum", 1e-6)):
        limit = schema[end]
        assert getattr(Tolerances.model_validate({knob: limit}), knob) == limit
        assert complaint({knob: limit + beyond}) == knob


@pytest.mark.parametrize("bits", [1, 7, 7.999, 8.5, 13])
def test_a_converter_that_nobody_builds_is_refused_by_name(bits: float) -> None:
    assert complaint({"adc_bits": bits}) == "adc_bits"


@pytest.mark.parametrize("bits", [0, 8, 9, 10, 11, 12])
def test_a_converter_has_whole_bits(bits: float) -> None:
    assert Tolerances(adc_bits=bits).adc_bits == bits


@pytest.mark.parametrize("name", list(PROFILES))
def test_every_value_of_a_profile_has_a_source(name: str) -> None:
    switched_on = {knob for knob, number in PROFILES[name].model_dump().items() if number}
    assert set(SOURCES[name]) == switched_on
    for knob, (number, source) in SOURCES[name].items():
        assert getattr(PROFILES[name], knob) == number
        assert source.strip(), knob
