"""What inspections come to, method by method: for the terminal and for the page."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from scipy.special import betaincinv

from aoicell.benchmark.records import PartRecord
from aoicell.benchmark.values import SMALL_MM, escaped, is_false_call

Outcome = Literal["escaped", "missed", "false call", "no verdict", "found", "allowed"]
WRONG: tuple[Outcome, ...] = ("escaped", "missed", "false call")
SURE = 0.95  # of an interval
# what is asked of an inspection
DETECTED_PERCENT, FALSE_PERCENT, SHIFT_MM, REGISTRATION_PX = 99, 0.1, 0.05, 0.5


@dataclass(frozen=True)
class Row:
    """A quantity of an inspection: a text for each method, and what is asked for."""

    name: str
    values: list[str]
    goal: str = ""


def rows(inspections: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """The headline numbers of each method; the values are its "inspection" of `summary.json`."""

    def row(name: str, text: Callable[[Mapping[str, Any]], str], goal: str = "") -> Row:
        return Row(name, [text(found) for found in inspections.values()], goal)

    def share(name: str, count: str, of: str, digits: int, goal: str) -> list[Row]:
        return [
            row(name, lambda i: percent(i[count], i[of], digits), goal),
            row("— 95 % interval", lambda i: interval(i[count], i[of], digits)),
        ]

    return [
        row("boards", lambda i: str(sum(i["verdicts"].values()))),
        row("— passed/failed/no verdict", lambda i: _counts(i["verdicts"], *_VERDICTS)),
        row("planted defects", lambda i: str(i["defects"])),
        row("— found", lambda i: str(i["found"])),
        *share("detection rate, %", "found", "defects", 2, f"≥ {DETECTED_PERCENT:g}"),
        row("missing parts said present", lambda i: str(i["escapes_missing"]), "0"),
        row("good parts", lambda i: str(i["good_components"])),
        row("— called wrong", lambda i: str(i["false_calls"])),
        *share("false calls, %", "false_calls", "good_components", 3, f"≤ {FALSE_PERCENT:g}"),
        row("parts without a verdict", lambda i: str(i["no_verdict"])),
        row("parts that no view shows", lambda i: str(i["unseen"])),
        row("shift error, mean, mm", lambda i: number(i["shift_error_mm"]["mean"])),
        row("— 95 %, mm", lambda i: number(i["shift_error_mm"]["p95"]), f"≤ {SHIFT_MM:g}"),
        row("views", lambda i: str(sum(i["registrations"].values()))),
        row("— registered/degraded/lost", lambda i: _counts(i["registrations"], *_OF)),
        row(
            "registration error, 95 %, px",
            lambda i: number(i["registration_px"]["p95"]),
            f"≤ {REGISTRATION_PX:g}",
        ),
    ]


_VERDICTS = ("pass", "fail", "no_verdict")
_OF = ("registered", "degraded", "no_verdict")


def notes() -> str:
    """What the rows mean."""
    large = " × ".join(f"{mm:g}" for mm in SMALL_MM)
    return (
        "What a part's tolerance class allows is no defect. Defects and good parts count on every "
        f"board, also where nothing was said of them. Missing parts: of at least {large} mm. Shift "
        "error: of the shifted parts whose shift was measured; registration error: of the views "
        "that were not lost; both by the truth, 95 %: the percentile. Intervals: Clopper and "
        "Pearson."
    )


def _counts(counts: Mapping[str, int], *names: str) -> str:
    return "/".join(str(counts.get(name, 0)) for name in names)


def number(value: float | None, digits: int = 3) -> str:
    """A decimal number, or a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}f}"


def percent(count: int, of: int, digits: int = 2) -> str:
    """A share in percent, or a dash where there is none."""
    return f"{100 * count / of:.{digits}f}" if of else "–"


def interval(count: int, of: int, digits: int = 2) -> str:
    """The 95 % interval of a share, in percent."""
    if not of:
        return "–"
    low, high = (f"{100 * share:.{digits}f}" for share in binomial_interval(count, of))
    return f"{low}–{high}"


def binomial_interval(count: int, of: int, sure: float = SURE) -> tuple[float, float]:
    """The shares under which `count` of `of` is not improbable (Clopper and Pearson, 1934)."""
    tail = (1 - sure) / 2
    low = betaincinv(count, of - count + 1, tail) if count else 0.0
    high = betaincinv(count + 1, of - count, 1 - tail) if count < of else 1.0
    return float(low), float(high)


def outcome(part: PartRecord, verdict: str) -> Outcome:
    """How a part ended, given its board's verdict.

    `escaped` and `missed`: something is wrong and it was said to be in order, or nothing was said
    on a board that was judged; the first where it is a missing part that must not escape.
    """
    if is_false_call(part):
        return "false call"
    if part.tolerated or not part.planted:
        return "allowed"
    if part.called:
        return "found"
    if escaped(part):
        return "escaped"
    silent = not part.state and verdict != "no_verdict"
    return "missed" if part.state == "present" or silent else "no verdict"


def words(name: str) -> str:
    """A name of the records as it is read: `no_verdict` as `no verdict`."""
    return name.replace("_", " ")
