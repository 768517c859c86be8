"""What a run comes to, in plain words and headline numbers."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from aoicell.report import paper
from aoicell.report.page_data import RunData
from aoicell.report.page_table import number


@dataclass(frozen=True)
class Verdict:
    """One method's outcome: whether it holds, why, and its counts of trials."""

    method: str
    holds: bool
    word: str
    left: str
    sentences: str
    counts: list[tuple[str, int]]


@dataclass(frozen=True)
class HeadlineRow:
    """A quantity: mean, median, 95th percentile and maximum of each method; the paper's print."""

    name: str
    unit: str
    values: list[list[str]]
    printed: str


def verdicts(run: RunData) -> list[Verdict]:
    """A verdict on each method, the one that leaves least first."""

    def left(name: str) -> float:
        mean = run.methods[name]["residual_mm"]["mean"]
        return np.inf if mean is None else mean

    ordered = sorted(run.methods, key=left)
    return [_verdict(name, run.methods[name], run.tolerances_mm) for name in ordered]


def _verdict(name: str, method: dict[str, Any], tolerances_mm: tuple[float, float]) -> Verdict:
    counts = [
        (what, method[key])
        for what, key in (("silently wrong", "silent_wrong"), ("refused", "refused"),
                          ("failed", "failed"), ("trials", "trials"))
    ]  # fmt: skip
    corrected, wrong, failed = (method[key] for key in ("corrected", "silent_wrong", "failed"))
    if not corrected:
        return Verdict(name, False, "corrected nothing", "–", _not_one(name, method), counts)
    holds = not wrong and not failed
    word = "holds" if holds else "does not hold"
    sentences = " ".join([_left(name, method), _within(method, tolerances_mm), _declined(method)])
    left = significant(method["residual_mm"]["mean"])
    return Verdict(name, holds, word, left, sentences.strip(), counts)


def _not_one(name: str, method: dict[str, Any]) -> str:
    if not method["trials"]:
        return f"{name} has no trial in this run."
    return (
        f"{name} corrected none of {_trials(method['trials'])}: {method['refused']} refused, "
        f"{method['failed']} failed."
    )


def _left(name: str, method: dict[str, Any]) -> str:
    left, moved = method["residual_mm"]["mean"], method["displacement_mm"]["mean"]
    compensated = 100 * method["compensation"]
    return (
        f"{name} leaves {significant(left)} mm on average after displacements of {moved:.1f} mm: "
        f"{number(compensated, 1)} % are compensated."
    )


def _within(method: dict[str, Any], tolerances_mm: tuple[float, float]) -> str:
    least, most = tolerances_mm
    tolerance = "tolerance of " + (
        f"{least:g} mm" if least == most else f"{least:g} to {most:g} mm"
    )
    corrected, wrong = method["corrected"], method["silent_wrong"]
    most_left = method["residual_mm"]["max"]
    worst = significant(most_left)
    if not wrong and most_left <= least:
        all_of = "The one corrected trial lies" if corrected == 1 else (
            f"All {corrected} corrected trials lie")  # fmt: skip
        return f"{all_of} within the {tolerance}; the worst leaves {worst} mm."
    if not wrong:
        return f"None was silently wrong ({tolerance}); the worst leaves {worst} mm."
    verb = "lies" if wrong == 1 else "lie"
    return (
        f"{wrong} of {_trials(corrected, 'corrected ')} {verb} beyond the {tolerance} and nothing "
        f"said so: silently wrong; the worst leaves {worst} mm."
    )


def _declined(method: dict[str, Any]) -> str:
    refused, failed, parts = method["refused"], method["failed"], []
    if refused:
        parts.append(f"{refused} {'was' if refused == 1 else 'were'} refused")
    if failed:
        parts.append(f"{failed} failed, which is a defect")
    return f"Of {_trials(method['trials'])} {' and '.join(parts)}." if parts else ""


def _trials(count: int, kind: str = "") -> str:
    return f"{count} {kind}trial{'' if count == 1 else 's'}"


def significant(value: float | None) -> str:
    """Three significant digits, never with an exponent for what a cell measures."""
    if value is None or not np.isfinite(value):
        return "–"
    digits = 2 - int(np.floor(np.log10(abs(value)))) if value else 2
    return number(value, min(max(digits, 0), 6))


_QUANTITIES = (
    ("board moved", "mm", "displacement_mm", 1.0, 1),
    ("left, from truth", "mm", "residual_mm", 1.0, 3),
    ("— lateral part", "mm", "residual_lateral_mm", 1.0, 3),
    ("— part in depth", "mm", "residual_depth_mm", 1.0, 3),
    ("view turned", "deg", "residual_deg", 1.0, 3),
    ("stated by the method", "mm", "predicted_mm", 1.0, 3),
    ("between the pictures", "px", "residual_px", 1.0, 2),
    ("— the same by truth", "px", "residual_true_px", 1.0, 2),
    ("— times the local scale", "mm", "image_mm", 1.0, 3),
    ("correction takes", "ms", "correction_seconds", 1e3, 0),
)
_STATISTICS = ("mean", "p50", "p95", "max")


def headline(run: RunData) -> list[HeadlineRow]:
    """The headline numbers; what no method has is left out."""
    first, second = paper.TESTS
    printed = {
        "displacement_mm": f"{first.moved_mm:g} and {second.moved_mm:g}",
        "residual_px": f"{paper.MEAN_PX:g}",
        "image_mm": f"{paper.MEAN_MM:g} ({first.left_mm:.2f} and {second.left_mm:.2f})",
    }
    rows = []
    for name, unit, key, factor, digits in _QUANTITIES:
        found = [method[key] for method in run.methods.values()]
        if any(s["mean"] is not None for s in found):
            values = [
                [number(None if s[k] is None else factor * s[k], digits) for k in _STATISTICS]
                for s in found
            ]
            rows.append(HeadlineRow(name, unit, values, printed.get(key, "")))
    compensated = [
        [number(None if c is None else 100 * c, 2), "", "", ""]
        for c in (method["compensation"] for method in run.methods.values())
    ]
    both = f"{first.compensated_percent:g} and {second.compensated_percent:g}"
    return [*rows, HeadlineRow("compensated", "%", compensated, both)]


def predictions(run: RunData) -> list[str]:
    """What each method's own statement of its error is worth, in a sentence each."""
    sentences = []
    for method in run.scenario.methods:
        mine = run.shown["method"] == method
        predicted, actual = run.shown["predicted_mm"][mine], run.shown["residual_mm"][mine]
        known = np.isfinite(predicted) & np.isfinite(actual) & (predicted > 0)
        if known.any():
            ratio = actual[known] / predicted[known]
            sentences.append(
                f"{method}: in {100 * np.mean(ratio <= 1):.0f} % of {known.sum()} trials less is "
                f"left than it predicted; the median of actual over predicted is "
                f"{np.median(ratio):.2f}, the largest {ratio.max():.2f}."
            )
        else:
            sentences.append(f"{method} states no error of its own.")
    return sentences
