"""What the page of a run that inspects says of it: numbers, tables and boards to be reviewed."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from aoicell.benchmark.store import RunStore
from aoicell.nominal import load_nominal
from aoicell.report.inspection_data import InspectionData, Part
from aoicell.report.inspection_numbers import WRONG, Row, binomial_interval, notes, rows, words
from aoicell.report.page_data import RunData
from aoicell.report.page_review import BOARDS_EACH, ReviewedBoard, reviewed_boards, worst_board
from aoicell.report.page_table import Column, Table, Value, make_table

MOST_ROWS = 60  # of wrong verdicts, for each method
_METHOD = Column("method")
_FOUND = (
    Column("planted", "", 0), Column("found", "", 0), Column("found", "%", 2),
    Column("at least", "%", 2), Column("missed", "", 0), Column("no verdict", "", 0),
)  # fmt: skip
_AT_LEAST = "At least: the lower end of the 95 % interval (Clopper and Pearson)."


@dataclass(frozen=True)
class InspectionSection:
    """All that the page shows of inspections beside figures.

    `commands` take the pictures of each method's worst board again.
    """

    methods: list[str]
    rows: list[Row]
    notes: str
    defects: Table
    components: Table
    missed: Table
    false_calls: Table
    boards: list[ReviewedBoard]
    boards_each: int
    commands: list[str]

    @property
    def size(self) -> int:
        """How many bytes its pictures take in the page."""
        return sum(board.size for board in self.boards)


def inspection_section(run: RunData, store: RunStore) -> InspectionSection:
    """The section of a run that has inspected."""
    inspection = run.inspection
    assert inspection is not None
    worst = [worst_board(inspection, method) for method in run.scenario.methods]
    numbers = dict.fromkeys(inspection.numbers[key] for key in worst if key is not None)
    return InspectionSection(
        methods=list(inspection.methods),
        rows=rows(inspection.methods),
        notes=notes(),
        defects=defects_table(run, inspection),
        components=components_table(run, inspection),
        missed=missed_table(run, inspection),
        false_calls=false_calls_table(run, inspection),
        boards=reviewed_boards(run, store, inspection),
        boards_each=BOARDS_EACH,
        commands=[repeat_command(number) for number in numbers],
    )


def defects_table(run: RunData, inspection: InspectionData) -> Table:
    """Each kind of defect by each method: how many were planted and how many found."""
    columns = [Column("defect"), _METHOD, *_FOUND, Column("within tolerance", "", 0)]
    groups = _groups(inspection.parts, lambda part: part.record.planted)
    table: list[list[Value]] = [
        [words(kind), method, *_found(mine), mine["allowed"]]
        for kind, method, mine in _in_order(run, groups)
        if kind
    ]
    return make_table(
        "by_defect", "By kind of defect", columns, table,
        f"{_AT_LEAST} Missed: said to be in order. Within tolerance: planted, but so little that "
        "the part's tolerance class allows it; it counts as a good part.",
    )  # fmt: skip


def components_table(run: RunData, inspection: InspectionData) -> Table:
    """Each kind of component by each method: its defects, and its good parts that were called."""
    columns = [
        Column("component"), _METHOD, Column("looked at", "", 0), *_FOUND,
        Column("false calls", "", 0), Column("false calls", "%", 3),
    ]  # fmt: skip
    board = run.scenario.fitted(load_nominal(run.scenario.cell_folder)).board
    count = Counter(component.kind for component in board.components)
    boards = inspection.boards
    table: list[list[Value]] = []
    for kind, method, mine in _in_order(run, _groups(inspection.parts, lambda p: p.record.kind)):
        looked_at, false = count[kind] * boards[method], mine["false call"]
        good = looked_at - sum(_defects(mine).values())
        share = 100 * false / good if good > 0 else None
        table.append([words(kind), method, looked_at or None, *_found(mine), false, share])
    return make_table(
        "by_component", "By kind of component", columns, table,
        f"Looked at: parts of the kind on all boards. {_AT_LEAST} False calls: good parts that "
        "were called wrong, and their share of the good parts of the kind.",
    )  # fmt: skip


def missed_table(run: RunData, inspection: InspectionData) -> Table:
    """Every defect that was not found, escapes first, and what repeats its trial alone."""
    parts = [p for p in inspection.parts if p.outcome in ("escaped", "missed", "no verdict")]
    return _one_by_one(
        run, "missed", "Defects that were not found", parts,
        "Escaped: a part that is missing was said to be there. Missed: a defect was said to be in "
        "order. No verdict: nothing was said of the part, so it goes to an operator.",
    )  # fmt: skip


def false_calls_table(run: RunData, inspection: InspectionData) -> Table:
    """Every good part that was called wrong, and what repeats its trial alone."""
    parts = [part for part in inspection.parts if part.outcome == "false call"]
    return _one_by_one(
        run, "false_calls", "Good parts that were called wrong", parts,
        "Planted: what was done to the part, where its tolerance class allows it.",
    )  # fmt: skip


def repeat_command(number: int) -> str:
    """What repeats a trial alone and keeps its pictures."""
    return f"aoicell run scenario.toml --only {number} --images"


def _one_by_one(run: RunData, id: str, caption: str, parts: list[Part], note: str) -> Table:
    columns = [
        _METHOD, Column("ended"), Column("trial", "", 0), Column("part"), Column("kind"),
        Column("size", "mm"), Column("planted"), Column("shift", "mm", 2), Column("turn", "deg", 1),
        Column("said"), Column("confidence", "", 2), Column("view"),
        Column("repeats it alone"),
    ]  # fmt: skip
    table, cut = [], 0
    for method in reversed(run.scenario.methods):  # first what the others are compared with
        mine = sorted(
            (part for part in parts if part.key.method == method),
            key=lambda part: (part.outcome not in WRONG, part.outcome, part.number),
        )
        cut += max(len(mine) - MOST_ROWS, 0)
        table += [_row(part) for part in mine[:MOST_ROWS]]
    more = f" {cut} more are in trials.sqlite, table 'parts'." if cut else ""
    return make_table(id, caption, columns, table, note + more)


def _row(part: Part) -> list[Value]:
    record, planted = part.record, part.record.planted
    return [
        part.key.method, part.outcome, part.number, record.component, words(record.kind),
        f"{record.width_mm:.1f} × {record.depth_mm:.1f}", words(planted) or "–",
        record.shift_mm if planted == "shifted" else None,
        record.rotation_deg if planted == "rotated" else None,
        words(record.state) or "nothing", record.confidence, record.view or "–",
        repeat_command(part.number),
    ]  # fmt: skip


# -- Counting ---------------------------------------------------------------------------

_Ends = Counter[str]
_Groups = dict[tuple[str, str], _Ends]


def _groups(parts: Iterable[Part], of: Callable[[Part], str]) -> _Groups:
    """How the parts ended, by what `of` says of them and by method."""
    groups: _Groups = {}
    for part in parts:
        groups.setdefault((of(part), part.key.method), Counter())[part.outcome] += 1
    return groups


def _in_order(run: RunData, groups: _Groups) -> Iterator[tuple[str, str, _Ends]]:
    """By name, and within by method as the scenario has them."""
    for name in sorted({name for name, _ in groups}):
        for method in run.scenario.methods:
            yield name, method, groups.get((name, method), Counter())


def _defects(ends: _Ends) -> dict[str, int]:
    return {name: ends[name] for name in ("found", "escaped", "missed", "no verdict")}


def _found(ends: _Ends) -> list[Value]:
    """The cells of `_FOUND`."""
    found, planted = ends["found"], sum(_defects(ends).values())
    share = 100 * found / planted if planted else None
    least = 100 * binomial_interval(found, planted)[0] if planted else None
    missed = ends["escaped"] + ends["missed"]
    return [planted, found, share, least, missed, ends["no verdict"]]
