"""Profiles: what is legal, what is refused, and that the message names the knob."""

import math

import pytest
from pydantic import ValidationError

from aoicell.sim.profiles import IDEAL, PAPER, PROFILES
from aoicell.sim.tolerances import Tolerances

SIGNED = {"mount_bias_x_mm", "mount_bias_z_mm", "k1"}
KNOBS = list(Tolerances.model_fields)


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


def test_ideal_is_exact() -> None:
    assert set(IDEAL.model_dump().values()) == {0.0}


def test_paper_holds_what_the_paper_states() -> None:
    assert (PAPER.mount_bias_x_mm, PAPER.mount_bias_z_mm) == (9.0, 2.0)


def test_every_knob_says_what_it_is_and_in_which_unit() -> None:
    units = ("_deg", "_mm", "_percent", "_px", "_grey")
    for name, field in Tolerances.model_fields.items():
        assert field.description
        assert name.endswith(units) or name.startswith("k1")
