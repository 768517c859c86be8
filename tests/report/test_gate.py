"""The same answer in a terminal, in Markdown and in JUnit XML."""

import re
from dataclasses import replace
from io import StringIO
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers.snapshots import changed, noisy, shifted
from rich.console import Console

from aoicell.benchmark.gate import GateResult, check
from aoicell.report.gate import gate_junit, gate_markdown, gate_table, headline
from aoicell.scenario import Scenario

SCENARIO = Scenario(name="ten_cells", methods=["paper", "aoicell"], worlds=10, trials_per_world=5)
BASELINE = noisy(SCENARIO, where="b.json")


@pytest.fixture(scope="module")
def worse() -> GateResult:
    """x worse, px better, the rest as it was."""
    return check(shifted(BASELINE, "aoicell", x_mm=0.05, detected_px=-0.2), BASELINE)


@pytest.fixture(scope="module")
def gone() -> GateResult:
    return check(changed(BASELINE, "paper", outcome="refused"), BASELINE)


def printed(result: GateResult, width: int = 80) -> str:
    output = StringIO()
    Console(file=output, width=width).print(gate_table(result))
    return output.getvalue()


def test_the_headline_counts(worse: GateResult, gone: GateResult) -> None:
    assert headline(worse) == "ten_cells: of 18 quantities 1 regressed, 1 improved"
    assert headline(check(BASELINE, BASELINE)) == "ten_cells: of 18 quantities none changed"
    assert headline(gone) == "ten_cells: of 13 quantities 1 regressed; 5 undecided"


def test_a_terminal_of_80_columns_shows_each_quantity_on_a_line(worse: GateResult) -> None:
    lines = [line.strip() for line in printed(worse).splitlines()]
    mine = lines[lines.index("aoicell") :]
    x = next(line for line in mine if line.startswith("x mm"))
    change = next(c for c in worse.changes if (c.method, c.quantity) == ("aoicell", "x_mm"))
    expected = [change.before, change.after, 0.05, 0.05, 0.05, 0.02]
    assert [float(n) for n in re.findall(r"[-+]?\d+\.\d+", x)] == pytest.approx(expected, abs=6e-4)
    assert x.endswith("regressed")
    px = next(line for line in mine if line.startswith("detected px"))
    assert px.endswith("improved")
    assert sum(line.startswith(("refused %", "silent wrong %")) for line in lines) == 4


def test_the_assumptions_stand_below(worse: GateResult, gone: GateResult) -> None:
    text = " ".join(printed(worse).split())
    assert "Compared with b.json: the same seeds: 50 pairs of trials in 10 worlds;" in text
    assert "larger than 0.02 mm, 0.1 px or 1 percentage points" in text
    assert "the share of trials that are newly hit" in text
    assert "Undecided: paper: too few trials of run have x_mm" in " ".join(printed(gone).split())


def test_what_no_change_can_reach_is_none() -> None:
    few = SCENARIO.model_copy(update={"worlds": 4})
    lines = printed(check(noisy(few.model_copy(update={"seed": 1})), noisy(few))).splitlines()
    assert sum(" none " in line and line.strip().startswith("failed %") for line in lines) == 2


def test_of_many_cases_only_what_changed_is_printed() -> None:
    sweep = SCENARIO.model_copy(update={"sweep": {"knobs": {"k1": [-0.1, -0.2, -0.3]}}})
    baseline = noisy(sweep)
    result = check(shifted(baseline, "paper", y_mm=0.1), baseline)
    lines = [line.strip() for line in printed(result, width=120).splitlines()]
    rows = [line for line in lines if re.match(r"\w+( \w+)? (mm|px|%) ", line)]
    assert len(rows) == 1
    assert "sweep k1 = -0.1, paper" in lines
    assert "53 quantities without a change are not listed." in lines


def test_markdown_puts_what_changed_on_top(worse: GateResult) -> None:
    text = gate_markdown(worse)
    top, folded = text.split("<details>")
    assert top.startswith("### ❌ ten\\_cells: of 18 quantities 1 regressed, 1 improved\n")
    rows = [line.split(" | ") for line in top.splitlines() if line.startswith("| aoicell")]
    assert [row[0] for row in rows] == ["| aoicell, x mm", "| aoicell, detected px"]
    assert [row[-1] for row in rows] == ["regressed |", "improved |"]
    assert folded.count("\n| ") == 2 + 18
    assert {line.count(" | ") for line in text.splitlines() if line.startswith("| ")} == {6}
    assert gate_markdown(check(BASELINE, BASELINE)).startswith("### ✅ ")


def test_markdown_takes_no_markup_from_a_name(worse: GateResult) -> None:
    first = replace(worse.changes[0], case="<script>|`*_[x](y)", verdict="regressed")
    text = gate_markdown(replace(worse, changes=(first,)))
    assert "| &lt;script&gt;\\|\\`\\*\\_\\[x\\](y), paper, x mm |" in text
    assert "<script>" not in text


def test_junit_has_a_case_for_each_quantity(worse: GateResult) -> None:
    (suite,) = ElementTree.fromstring(gate_junit(worse))
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("18", "1", "0")
    cases = {(case.get("classname"), case.get("name")): case for case in suite}
    assert len(cases) == 18
    failures = {key: case.find("failure") for key, case in cases.items() if len(case) == 1
                and case[0].tag == "failure"}  # fmt: skip
    ((key, failure),) = failures.items()
    assert key == ("aoicell.ten_cells.aoicell", "x_mm")
    assert failure is not None
    assert "change +0.050" in (failure.get("message") or "")
    assert "verdict improved" in (cases[key[0], "detected_px"].findtext("system-out") or "")


def test_junit_names_what_is_undecided_as_an_error(gone: GateResult) -> None:
    (suite,) = ElementTree.fromstring(gate_junit(gone))
    assert (suite.get("tests"), suite.get("errors")) == ("18", "5")
    assert len(suite.findall("testcase/error")) == 5


def test_junit_holds_any_name(worse: GateResult) -> None:
    first = replace(worse.changes[0], case='<&"\x00\ufffe>')
    (suite,) = ElementTree.fromstring(gate_junit(replace(worse, changes=(first,))))
    assert suite[0].get("classname") == 'aoicell.ten_cells.<&"??>.paper'


def test_numbers_that_round_to_nothing_have_no_minus(worse: GateResult) -> None:
    change = replace(worse.changes[0], before=-1e-5, after=np.float64(-0.0), change=-1e-5)
    result = replace(worse, changes=(change,))
    assert "-0.000 " not in printed(result)
    assert "+0.000" in printed(result)
