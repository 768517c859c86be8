"""The gate: has a run become worse than its baseline?

A change counts when it is real (the false alarm rate of a whole check is at most 1 %, by Holm)
and larger than a practical size. With the same seeds trials are compared in pairs, since they
share every draw; with other seeds the worlds of both runs are independent samples.
"""

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from aoicell.benchmark.gate_experiment import (
    Pairs,
    describe,
    refuse_fewer_trials,
    refuse_other_experiments,
    remarks,
    shape,
)
from aoicell.benchmark.gate_quantities import (
    FEWEST,
    RATES,
    SIGNED,
    Comparison,
    Question,
    quantities,
)
from aoicell.benchmark.gate_statistics import Evidence, holm
from aoicell.benchmark.snapshot import Snapshot
from aoicell.errors import InputError, Refused
from aoicell.scenario import cases_of

FALSE_ALARM = 0.01  # of a whole check

Verdict = Literal["regressed", "improved", "unchanged", "not shown"]


@dataclass(frozen=True)
class PracticalSizes:
    """The smallest changes that matter; `points` of rates, in percentage points.

    0.02 mm is below what two arrivals of a good arm differ by (0.034 mm), and 0.1 px is
    about as much at the taught views. Baselines of other machines compare within these sizes.
    """

    mm: float = 0.02
    px: float = 0.1
    points: float = 1.0

    def __post_init__(self) -> None:
        for name, size in asdict(self).items():
            if not 0 <= size < np.inf:
                raise InputError(f"practical size in {name} = {size}: give a number from 0 on")


@dataclass(frozen=True)
class Change:
    """One quantity of one method: means before and after, in `unit`; rates in %.

    `low` to `high` is the interval of the change that holds for all quantities of the check
    at once with 99 %; `detectable` the smallest change found with 80 %, of rates the share
    of trials (of worlds, where seeds differ) that an event newly hits; None: none is found.
    `unchanged`: the interval lies within the practical size; `not shown`: it does not.
    """

    case: str
    method: str
    quantity: str
    unit: str
    before: float
    after: float
    change: float
    low: float
    high: float
    p: float
    detectable: float | None
    verdict: Verdict


@dataclass(frozen=True)
class GateResult:
    """All quantities, in what way they were compared, and what could not be."""

    run: str
    baseline: str
    scenario: str
    paired: bool
    compared: str
    notes: tuple[str, ...]
    undecided: tuple[str, ...]
    practical: PracticalSizes
    changes: tuple[Change, ...]

    def of(self, verdict: Verdict) -> list[Change]:
        """The changes with this verdict."""
        return [change for change in self.changes if change.verdict == verdict]

    @property
    def passed(self) -> bool:
        """Nothing regressed, and everything could be compared."""
        return not (self.of("regressed") or self.undecided)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"schema": 1, "passed": self.passed, **asdict(self)}


def check(run: Snapshot, baseline: Snapshot, practical: PracticalSizes | None = None) -> GateResult:
    """Compare a run with its baseline.

    Raises InputError where they are not of the same experiment, and Refused where there are
    too few worlds or trials to tell a change from chance.
    """
    practical = practical or PracticalSizes()
    refuse_other_experiments(run, baseline)
    pairs = list(zip(cases_of(run.scenario), cases_of(baseline.scenario), strict=True))
    how = _way_to_compare(run, baseline, pairs)
    questions, undecided = _questions(run, baseline, pairs, how)
    if not questions:
        few = f"{baseline.where} has fewer than {FEWEST} trials by any method: too few to compare"
        raise Refused(undecided[0] if undecided else few)
    level = FALSE_ALARM / len(questions)
    evidence = [how.evidence(question, level) for question in questions]
    real = holm([e.p for e in evidence], FALSE_ALARM)
    changes = [
        _judge(*judged, how.by_world, practical)
        for judged in zip(questions, evidence, real, strict=True)
    ]
    return GateResult(
        run.where, baseline.where, run.scenario.name, how.paired,
        describe(run, baseline, pairs, how), tuple(remarks(run, baseline, pairs, how.paired)),
        tuple(undecided), practical, tuple(changes),
    )  # fmt: skip


def _way_to_compare(run: Snapshot, baseline: Snapshot, pairs: Pairs) -> Comparison:
    """In pairs where all seeds are the same. Raises InputError or Refused, as `check`."""
    worlds = [shape(case)[0] for both in pairs for case in both]
    if all(now.scenario.seed == then.scenario.seed for now, then in pairs):
        refuse_fewer_trials(run, baseline, pairs)
        return Comparison(paired=True, by_world=min(worlds) >= FEWEST)
    if min(worlds) < FEWEST:
        raise Refused(
            f"{run.where} has other seeds than {baseline.where}, and one of them has {min(worlds)} "
            f"world{'s' if min(worlds) > 1 else ''}: trials of one world share its calibration, so "
            f"{FEWEST} worlds on each side are the least; run more, or with seed "
            f"{baseline.scenario.seed}"
        )
    return Comparison(paired=False, by_world=True)


def _questions(
    run: Snapshot, baseline: Snapshot, pairs: Pairs, how: Comparison
) -> tuple[list[Question], list[str]]:
    """What there is to test, and sentences about what can no longer be tested."""
    questions, undecided = [], []
    for now, then in pairs:
        tolerance = then.scenario.tolerance_mm
        worlds, trials = shape(then)
        label = "" if len(pairs) == 1 else f"{then.kind} {then.label}".strip()
        for method in baseline.scenario.methods:
            befores = quantities(baseline.trials[then.index, method], tolerance)
            afters = quantities(run.trials[now.index, method], tolerance)
            for name, before in befores.items():
                after = afters[name][:worlds, :trials] if how.paired else afters[name]
                question = Question(label, method, name, before, after)
                if how.enough(question):
                    questions.append(question)
                elif how.enough(Question(label, method, name, before, before)):
                    place = f"{label}, {method}" if label else method
                    undecided.append(f"{place}: too few trials of {run.where} have {name} to test")
    return questions, undecided


def _judge(
    question: Question, evidence: Evidence, real: bool, by_world: bool, practical: PracticalSizes
) -> Change:
    rate = question.quantity in RATES
    unit = "%" if rate else question.quantity.rsplit("_", 1)[1]
    scale = 100 if rate else 1
    size = {"%": practical.points, "mm": practical.mm, "px": practical.px}[unit]
    change, low, high = (scale * v for v in (evidence.change, evidence.low, evidence.high))
    if real and abs(change) > size:
        worse = _is_worse(question.quantity, evidence, by_world)
        verdict: Verdict = "regressed" if worse else "improved"
    else:
        verdict = "unchanged" if -size <= low and high <= size else "not shown"
    found = evidence.detectable
    return Change(
        question.case, question.method, question.quantity, unit, scale * evidence.before,
        scale * evidence.after, change, low, high, evidence.p,
        None if found is None else max(scale * found, size), verdict,
    )  # fmt: skip


def _is_worse(quantity: str, evidence: Evidence, by_world: bool) -> bool:
    """Less is better; a signed mean that moved is better only if surely closer to zero.

    A bias may hide in the magnitude of the residuals, and by chance point against what was
    there. In a few worlds even a sure approach may be a bias that cancels their own error.
    """
    if quantity in SIGNED:
        return not (by_world and evidence.nearer)
    return evidence.change > 0
