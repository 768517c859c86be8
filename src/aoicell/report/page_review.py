"""The reviewer's part of the page: pictures, boxes and verdicts of the boards that ended worst."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from aoicell.benchmark.records import InspectionRecord, PartRecord, RegistrationRecord
from aoicell.benchmark.store import RunStore
from aoicell.report.inspection_data import BoardKey, InspectionData
from aoicell.report.inspection_numbers import WRONG, Outcome, outcome, words
from aoicell.report.page_data import RunData, case_name
from aoicell.report.page_table import number as decimal
from aoicell.report.review_pictures import Pictures, embedded, laid_over, strip

MOST_BYTES = 4_000_000  # of all pictures; a page is to stay below 10 MB
BOARDS_EACH = 3  # of a method
PARTS_EACH = 40  # of a board
_ORDER: tuple[Outcome, ...] = (*WRONG, "no verdict", "found", "allowed")


@dataclass(frozen=True)
class Box:
    """Where a part lies in the pictures (px), with its number in the list and how it ended.

    `label` stands beside it, `title` says all of it.
    """

    number: int
    x: float
    y: float
    width: float
    height: float
    label: str
    title: str
    kind: str


@dataclass(frozen=True)
class ReviewedView:
    """One view: data URIs of picture, reference and difference, of one size (px), and boxes."""

    name: str
    caption: str
    layers: dict[str, str]
    width: int
    height: int
    boxes: list[Box]


@dataclass(frozen=True)
class ReviewedPart:
    """A finding: what was planted, what was said, how that ended (`kind`: right, wrong, open).

    `strip` is a data URI of the part in picture, reference and difference; "" where no view has it.
    """

    number: int
    name: str
    planted: str
    said: str
    outcome: str
    kind: str
    strip: str


@dataclass(frozen=True)
class ReviewedBoard:
    """A board as one method saw it; wrong verdicts come first."""

    id: str
    title: str
    views: list[ReviewedView]
    parts: list[ReviewedPart]
    more: int

    @property
    def size(self) -> int:
        """How many bytes its pictures take in the page."""
        pictures = [uri for view in self.views for uri in view.layers.values()]
        return sum(map(len, [*pictures, *(part.strip for part in self.parts)]))


def reviewed_boards(
    run: RunData, store: RunStore, inspection: InspectionData
) -> list[ReviewedBoard]:
    """Up to `BOARDS_EACH` boards a method whose pictures were kept, as long as there is room.

    The most wrong verdicts come first, and the method that finds most and calls least wrong.
    """

    def worth(method: str) -> tuple[int, int]:
        of = inspection.methods[method]
        return -of["found"], of["false_calls"]

    room, found = MOST_BYTES, []
    methods = sorted(run.scenario.methods, key=worth)
    ranked = {method: _ranked(store, inspection, method) for method in methods}
    for turn in range(BOARDS_EACH):
        for method in methods:
            if turn < len(ranked[method]):
                board = _board(run, store, inspection, ranked[method][turn])
                if board.size <= room:
                    room -= board.size
                    found.append((method, board))
    return [board for method in methods for owner, board in found if owner == method]


def worst_board(inspection: InspectionData, method: str) -> BoardKey | None:
    """The board with the most wrong verdicts of a method, then with the most open ones."""
    return next(iter(_order(inspection, method)), None)


def _order(inspection: InspectionData, method: str) -> list[BoardKey]:
    bad = {key: [0, 0, 0] for key in inspection.verdicts if key.method == method}
    for part in inspection.parts:
        if part.key in bad:
            bad[part.key][0] -= part.is_wrong
            bad[part.key][1] -= part.outcome == "no verdict"
            bad[part.key][2] -= 1
    return sorted(bad, key=lambda key: (bad[key], inspection.numbers[key]))


def _ranked(store: RunStore, inspection: InspectionData, method: str) -> list[BoardKey]:
    """The boards whose pictures were kept; no more than are shown."""
    kept = []
    for key in _order(inspection, method):
        if any(_paths(store, key, view) for view in inspection.seen.get(key, ())):
            kept.append(key)
        if len(kept) == BOARDS_EACH:
            break
    return kept


def _paths(store: RunStore, key: BoardKey, view: str) -> tuple[Path, Path] | None:
    """Where the reference and the new picture of a view lie, where both were kept."""
    standard = store.image_path(key.world, view, case=key.case)
    new = store.image_path(key.world, view, key.trial, key.method, key.case)
    return (standard, new) if standard.is_file() and new.is_file() else None


# -- One board --------------------------------------------------------------------------


def _board(
    run: RunData, store: RunStore, inspection: InspectionData, key: BoardKey
) -> ReviewedBoard:
    [record] = store.trials(
        "case_index = ? AND world = ? AND trial = ? AND method = ?", *key
    )  # fmt: skip
    assert record.inspection is not None
    number, board = inspection.numbers[key], record.inspection
    ended = {id(part): outcome(part, board.verdict) for part in board.parts}
    parts = sorted(board.parts, key=lambda p: (_ORDER.index(ended[id(p)]), p.component))
    shown = [(n, part, ended[id(part)]) for n, part in enumerate(parts[:PARTS_EACH], start=1)]
    views = sorted(
        {part.view for _, part, _ in shown if part.view},
        key=lambda view: (-_wrong_in(view, shown), view),
    )
    pictures = {
        view: laid_over(*paths) for view in views if (paths := _paths(store, key, view)) is not None
    }
    states = {registration.view: registration for registration in board.registrations}
    return ReviewedBoard(
        id=f"board-{number}-{run.scenario.methods.index(key.method)}",
        title=_title(run, key, number, board, list(ended.values())),
        views=[
            _view(view, found, states.get(view), [s for s in shown if s[1].view == view])
            for view, found in pictures.items()
        ],
        parts=[_part(*found, pictures.get(found[1].view)) for found in shown],
        more=len(parts) - len(shown),
    )


_Shown = tuple[int, PartRecord, Outcome]


def _wrong_in(view: str, shown: Sequence[_Shown]) -> int:
    return sum(part.view == view and ended in WRONG for _, part, ended in shown)


def _title(
    run: RunData, key: BoardKey, number: int, board: InspectionRecord, ended: list[Outcome]
) -> str:
    case = f"{case_name(run.cases[key.case])}, " if len(run.cases) > 1 else ""
    counts = [(ended.count(name), name) for name in _ORDER if ended.count(name)]
    what = ", ".join(_counted(*pair) for pair in counts) or "nothing planted or called"
    return (
        f"{key.method}, {case}trial {number} (world {key.world + 1}, test {key.trial + 1}): "
        f"{board.verdict.replace('_', ' ')}; {what}"
    )


def _counted(count: int, ended: Outcome) -> str:
    return f"{count} {ended}{'s' if ended == 'false call' and count > 1 else ''}"


def _view(
    view: str, found: Pictures, registration: RegistrationRecord | None, shown: list[_Shown]
) -> ReviewedView:
    height, width = found.layers[0].shape
    boxes = [
        _box(number, part, ended, part.box_px)
        for number, part, ended in reversed(shown)
        if part.box_px
    ]
    return ReviewedView(
        view, _caption(view, registration, found.aligned), embedded(found), width, height, boxes
    )


def _box(number: int, part: PartRecord, ended: Outcome, box_px: Sequence[float]) -> Box:
    left, top, right, bottom = box_px
    title = f"{part.component}, planted: {_planted(part)}; said: {_said(part)}; {ended}"
    return Box(
        number, left, top, right - left, bottom - top, words(part.state), title, _kind(ended)
    )


def _kind(ended: Outcome) -> str:
    return "wrong" if ended in WRONG else "open" if ended == "no verdict" else "right"


def _caption(view: str, registration: RegistrationRecord | None, aligned: bool) -> str:
    parts = [view]
    if registration is not None:
        parts.append(words(registration.state))
        for px, whose in ((registration.own_px, "by itself"), (registration.error_px, "by truth")):
            if px is not None:
                parts.append(f"{px:.2f} px {whose}")
    if not aligned:
        parts.append("the picture could not be laid over the reference and is shown as it lies")
    return ", ".join(parts)


def _part(number: int, part: PartRecord, ended: Outcome, pictures: Pictures | None) -> ReviewedPart:
    return ReviewedPart(
        number, f"{part.component} ({words(part.kind)})", _planted(part), _said(part), ended,
        _kind(ended), strip(pictures, part.box_px),
    )  # fmt: skip


def _planted(part: PartRecord) -> str:
    planted = words(part.planted) or "nothing"
    if part.planted == "shifted":
        planted += f" by {part.shift_mm:.2f} mm"
    if part.planted == "rotated":
        planted += f" by {decimal(part.rotation_deg, 1)} deg"
    if part.planted == "foreign_object" and part.reason:
        planted += f", {part.reason}"
    return f"{planted}, within its tolerance" if part.tolerated else planted


def _said(part: PartRecord) -> str:
    said = [words(part.state) or "nothing"]
    if part.confidence is not None and part.state:
        said.append(f"confidence {part.confidence:.2f}")
    if part.shift_error_mm is not None:
        said.append(f"shift off by {part.shift_error_mm:.3f} mm")
    if part.reason and part.planted != "foreign_object":  # there it says what was planted
        said.append(part.reason)
    return ", ".join(said)
