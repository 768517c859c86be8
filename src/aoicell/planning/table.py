"""Which view shows what: coverage by feature and by component, as tables."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from aoicell.nominal import View
from aoicell.planning.coverage import Inspector, Sight
from aoicell.planning.targets import Hidden

State = Literal["seen", "missed", "hidden"]


@dataclass(frozen=True)
class FeatureRow:
    """One feature in the view that shows it best; without a view where none shows any of it."""

    target: str
    kind: str
    what: str
    state: State
    view: str = ""
    sight: Sight | None = None
    reason: str = ""


@dataclass(frozen=True)
class TargetRow:
    """One component: `view` shows most of its features; figures are its worst over all of them."""

    target: str
    kind: str
    state: State
    view: str
    features: int
    share: float
    px_per_mm: float
    angle_deg: float
    margin_px: float
    reason: str


@dataclass(frozen=True)
class CoverageTable:
    """All features, and all targets. A target without a feature that can be seen is hidden."""

    features: tuple[FeatureRow, ...]
    targets: tuple[TargetRow, ...]

    @property
    def coverage(self) -> float:
        """Targets all of whose features are seen, over those that can be seen; 1 of none."""
        count = sum(row.state != "hidden" for row in self.targets)
        return sum(row.state == "seen" for row in self.targets) / count if count else 1.0


def tabulate(
    inspector: Inspector, views: Sequence[View], hidden: Sequence[Hidden], kinds: dict[str, str]
) -> CoverageTable:
    """What the views show. `hidden` does not count; `kinds` names the kind of its targets."""
    excused = {(h.target, h.what): h.reason for h in hidden}
    values = np.array([inspector.values(view) for view in views])
    sights = [inspector.sights(view) for view in views]
    rows = []
    for k, feature in enumerate(inspector.scene.features):
        best = _best(values[:, k], [row[k] for row in sights])
        sight, seen = sights[best][k], bool(values[best, k] > 0)
        reason = excused.get((feature.target, feature.what), "")
        state: State = "seen" if seen else "hidden" if reason else "missed"
        shown = seen or sight.margin_px > 0
        rows.append(
            FeatureRow(
                feature.target, feature.kind, feature.what, state,
                views[best].id if shown else "", sight if shown else None,
                "" if seen else reason or _why(sight, inspector),
            )
        )  # fmt: skip
    done = {(row.target, row.what) for row in rows}
    rows += [
        FeatureRow(h.target, kinds.get(h.target, ""), h.what, "hidden", reason=h.reason)
        for h in hidden if (h.target, h.what) not in done
    ]  # fmt: skip
    targets = list(dict.fromkeys(row.target for row in rows))
    return CoverageTable(
        tuple(rows), tuple(_target([r for r in rows if r.target == t]) for t in targets)
    )


def _best(values: np.ndarray, sights: Sequence[Sight]) -> int:
    if values.max() > 0:
        return int(values.argmax())
    return int(np.argmax([min(s.margin_px, 0) + s.share for s in sights]))


def _why(sight: Sight, inspector: Inspector) -> str:
    """The first limit that the best view breaks."""
    limits = inspector.scene.limits
    if sight.margin_px < limits.margin_px:
        return "not in any picture with its margin"
    if sight.px_per_mm < limits.px_per_mm:
        return f"{sight.px_per_mm:.1f} px/mm are too few"
    if sight.angle_deg > limits.angle_deg:
        return f"seen {sight.angle_deg:.0f} deg off its normal"
    if sight.blur_px > limits.blur_px:
        return f"out of focus by {sight.blur_px:.1f} px"
    return f"{sight.share:.0%} of it visible: something taller or a lamp's glare is in the way"


def _target(rows: Sequence[FeatureRow]) -> TargetRow:
    counting = [row for row in rows if row.state != "hidden"]
    state: State = "hidden"
    if counting:
        state = "seen" if all(row.state == "seen" for row in counting) else "missed"
    views = [row.view for row in counting if row.view]
    view = max(dict.fromkeys(views), key=views.count) if views else ""
    sights = [row.sight for row in counting if row.sight]
    reasons = dict.fromkeys(row.reason for row in rows if row.reason)
    return TargetRow(
        rows[0].target, rows[0].kind, state, view, len(counting),
        share=min((s.share for s in sights), default=0.0),
        px_per_mm=min((s.px_per_mm for s in sights), default=0.0),
        angle_deg=max((s.angle_deg for s in sights), default=0.0),
        margin_px=min((s.margin_px for s in sights), default=0.0),
        reason="; ".join(reasons),
    )  # fmt: skip
