"""The gate's answer for a terminal, for a build summary (Markdown) and as JUnit XML."""

import html
import re
from xml.etree import ElementTree

from rich import box
from rich.table import Table
from rich.text import Text

from aoicell.benchmark.gate import Change, GateResult, Verdict

MANY = 40  # more rows are not for reading: only what changed is then listed
_DIGITS = {"mm": 3, "px": 2, "%": 1}
_COLUMNS = ("quantity", "before", "after", "change", "99 % interval", "found from", "verdict")
_COLOURS: dict[Verdict, str] = {"regressed": "bold red", "improved": "green"}


def headline(result: GateResult) -> str:
    """The outcome in a sentence."""
    counts = [
        f"{len(result.of(verdict))} {verdict}"
        for verdict in ("regressed", "improved")
        if result.of(verdict)
    ]
    changed = ", ".join(counts) or "none changed"
    undecided = f"; {len(result.undecided)} undecided" if result.undecided else ""
    return f"{result.scenario}: of {len(result.changes)} quantities {changed}{undecided}"


def gate_table(result: GateResult) -> Table:
    """What changed against the baseline, row by row, with its assumptions below."""
    table = Table(
        title=Text(headline(result)), title_justify="left", caption_justify="left",
        box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True,
    )  # fmt: skip
    for index, column in enumerate(_COLUMNS):
        edge = index in (0, len(_COLUMNS) - 1)
        header = column.replace("found ", "found\n")
        table.add_column(header, justify="left" if edge else "right", no_wrap=index > 0)
    shown, place = _shown(result), ""
    for change in shown:
        if _place(change) != place:
            place = _place(change)
            table.add_row(Text(place, style="bold"))
        name, *cells = (Text(cell) for cell in _cells(change))
        cells[-1].stylize(_COLOURS.get(change.verdict, ""))
        table.add_row(Text(f"  {name}"), *cells)
    table.caption = Text("\n".join(_explained(result, len(shown))))
    return table


def gate_markdown(result: GateResult) -> str:
    """A section for a build summary: what changed on top, all quantities folded below."""
    changed = [*result.of("regressed"), *result.of("improved")]
    mark = "✅" if result.passed else "❌"
    lines = [f"### {mark} {_escaped(headline(result))}", ""]
    if changed:
        lines += [*_markdown_rows(changed), ""]
    lines += [f"- {_escaped(line)}" for line in _explained(result, len(result.changes))]
    lines += ["", "<details><summary>All quantities</summary>", ""]
    lines += [*_markdown_rows(list(result.changes)), "", "</details>", ""]
    return "\n".join(lines)


def gate_junit(result: GateResult) -> bytes:
    """A test suite with one case a quantity; what could not be compared is an error."""
    suite = ElementTree.Element(
        "testsuite", name=f"aoicell check {result.scenario}",
        tests=str(len(result.changes) + len(result.undecided)),
        failures=str(len(result.of("regressed"))), errors=str(len(result.undecided)), skipped="0",
    )  # fmt: skip
    for change in result.changes:
        place = ".".join(filter(None, ("aoicell", result.scenario, change.case, change.method)))
        case = ElementTree.SubElement(
            suite, "testcase", classname=_xml(place), name=change.quantity
        )
        text = ", ".join(
            f"{column} {cell}"
            for column, cell in zip(_COLUMNS[1:], _cells(change)[1:], strict=True)
        )
        if change.verdict == "regressed":
            failure = ElementTree.SubElement(case, "failure", message=text)
            failure.text = result.compared
        else:
            ElementTree.SubElement(case, "system-out").text = text
    for sentence in result.undecided:
        case = ElementTree.SubElement(
            suite, "testcase", classname=f"aoicell.{result.scenario}", name="comparable"
        )
        ElementTree.SubElement(case, "error", message=_xml(sentence))
    ElementTree.indent(suite)
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    data: bytes = ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True)
    return data + b"\n"


# -- Rows and sentences -------------------------------------------------------------------


def _shown(result: GateResult) -> list[Change]:
    """All quantities, or those that changed where all are too many."""
    if len(result.changes) <= MANY:
        return list(result.changes)
    return [*result.of("regressed"), *result.of("improved")]


def _place(change: Change) -> str:
    return ", ".join(filter(None, (change.case, change.method)))


def _cells(change: Change) -> list[str]:
    """Text in the order of `_COLUMNS`."""
    digits = _DIGITS[change.unit]

    def number(value: float, sign: str = "") -> str:
        text = f"{value:{sign}.{digits}f}"
        return f"{0:{sign}.{digits}f}" if float(text) == 0 else text  # no -0.000

    name, _, suffix = change.quantity.rpartition("_")
    name = name if suffix == change.unit else change.quantity
    found = "none" if change.detectable is None else number(change.detectable)
    return [
        f"{name.replace('_', ' ')} {change.unit}",
        number(change.before), number(change.after), number(change.change, "+"),
        f"{number(change.low, '+')}..{number(change.high, '+')}", found, change.verdict,
    ]  # fmt: skip


def _explained(result: GateResult, shown: int) -> list[str]:
    """How it was compared, and what a reader should know."""
    sizes = result.practical
    lines = [
        f"Compared with {result.baseline}: {result.compared}.",
        "A change counts when it is real (any false alarm: at most 1 %) and larger than "
        f"{sizes.mm:g} mm, {sizes.px:g} px or {sizes.points:g} percentage points; one from the "
        "size under 'found from' on is found with 80 % (of rates: the share of "
        f"{'trials' if result.paired else 'worlds'} that are newly hit).",
        *(f"Note: {note}." for note in result.notes),
        *(f"Undecided: {sentence}." for sentence in result.undecided),
    ]
    left = len(result.changes) - shown
    return [*lines, f"{left} quantities without a change are not listed."] if left else lines


def _markdown_rows(changes: list[Change]) -> list[str]:
    rows: list[tuple[str, ...]] = [_COLUMNS, ("---", *["---:"] * (len(_COLUMNS) - 2), "---")]
    for change in changes:
        name, *others = _cells(change)
        rows.append((_escaped(f"{_place(change)}, {name}"), *others))
    return [f"| {' | '.join(row)} |" for row in rows]


def _escaped(text: str) -> str:
    """Names of cases are anyone's: no markup of Markdown or HTML in them."""
    return re.sub(r"([\\`*_\[\]|~#])", r"\\\1", html.escape(text, quote=False))


def _xml(text: str) -> str:
    """Without the characters that XML cannot hold."""
    return re.sub(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "?", text)
