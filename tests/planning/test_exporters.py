"""Exported programs: held by golden files, and by reading them back."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.programs import FILES, TWO_VIEWS

from aoicell.planning.exporters import EXPORTERS, to_hrl, to_urscript
from aoicell.planning.program import Move

STOPS_DEG = [TWO_VIEWS.start_deg, *(move.joints_deg for move in TWO_VIEWS.moves)]


@pytest.mark.parametrize("language", list(EXPORTERS))
def test_the_text_is_as_it_was(language: str) -> None:
    suffix, write = EXPORTERS[language]
    assert write(TWO_VIEWS) == (FILES / f"two_views{suffix}").read_text()


@pytest.mark.parametrize("language", list(EXPORTERS))
def test_the_head_says_that_it_has_not_run(language: str) -> None:
    _, write = EXPORTERS[language]
    assert any("NOT RUN ON A CONTROLLER" in line for line in write(TWO_VIEWS).splitlines()[:4])


def test_hrl_goes_to_the_points_of_the_program() -> None:
    text = to_hrl(TWO_VIEWS)
    points = {
        number: [float(angle) for angle in re.findall(r"A\d (-?[\d.]+)", axes)]
        for number, axes in re.findall(r"^E6AXIS (P\d+)={(.*)}$", text, re.MULTILINE)
    }
    visited = [points[number] for number in re.findall(r"^PTP (P\d+) ", text, re.MULTILINE)]
    np.testing.assert_allclose(visited, STOPS_DEG, atol=0.0005)


def test_urscript_goes_to_the_points_of_the_program_in_their_times() -> None:
    calls = re.findall(r"movej\(\[(.*)\], (.*)\)", to_urscript(TWO_VIEWS))
    visited = [[float(a) for a in re.findall(r"d2r\((-?[\d.]+)\)", q)] for q, _ in calls]
    np.testing.assert_allclose(visited, STOPS_DEG, atol=1e-6)
    times = [float(how.removeprefix("t=")) for _, how in calls[1:]]
    np.testing.assert_allclose(times, [move.duration for move in TWO_VIEWS.moves], atol=0.0005)


@pytest.mark.parametrize("language", list(EXPORTERS))
def test_pictures_are_triggered_where_they_belong(language: str) -> None:
    _, write = EXPORTERS[language]
    lines = [
        line for line in write(TWO_VIEWS).splitlines() if re.search(r"picture V\d|^PTP|movej", line)
    ]
    kinds = [re.sub(r".*(picture V\d).*|.*(PTP|movej).*", r"\1", line) for line in lines]
    assert kinds == ["", "", "", "picture V1", "", "picture V4", ""]


@pytest.mark.parametrize("language", list(EXPORTERS))
def test_no_name_ends_its_comment(language: str) -> None:
    _, write = EXPORTERS[language]
    sly = replace(TWO_VIEWS, name="x\nPTP P9", steps=(Move("y\nhalt", STOPS_DEG[0], 1.0),))
    lines = write(sly).splitlines()
    assert not [line for line in lines if line.startswith(("PTP P9", "halt"))]
