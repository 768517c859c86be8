"""All that is wrong with a board's component list, not only the first complaint."""

import re
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from aoicell.board import BoardDesign, load_board
from aoicell.errors import ModelError
from aoicell.planning.pick_and_place import raise_all
from aoicell.toml_table import TomlTable

_MOST = 200  # complaints; a list with more is the wrong file


def load_checked(folder: Path) -> BoardDesign:
    """As `aoicell.board.load_board`; raises InputError with what is wrong with every line."""
    try:
        return load_board(folder)
    except ModelError as error:
        if not re.search(r", line (?!1:)\d+", str(error)):
            raise  # about the folder, the TOML file or the header
    name = TomlTable.read(folder / "board.toml").text("components")
    raise_all(folder / name, _complaints(folder, name))
    return load_board(folder)


def _complaints(folder: Path, name: str) -> list[str]:
    """One for each bad line: it is blanked in a copy, until the rest is read."""
    wrong: list[str] = []
    gone: set[str] = set()
    with TemporaryDirectory() as scratch:
        copy = Path(scratch)
        shutil.copyfile(folder / "board.toml", copy / "board.toml")
        lines = (folder / name).read_text(encoding="utf-8").splitlines()
        while len(wrong) < _MOST:
            (copy / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
            try:
                load_board(copy)
            except ModelError as error:
                found = re.search(r", line (\d+)(.*)", str(error), re.DOTALL)
                if found is None:
                    raise
                line = int(found[1])
                gone.add(lines[line - 1].split(",")[0])
                carrier = re.match(r", column on: '(.*?)' is no component", found[2])
                if not (carrier and carrier[1] in gone):  # what it stands on is wrong itself
                    wrong.append(f"line {line}{found[2]}")
                lines[line - 1] = ""
                continue
            break
    return sorted(wrong, key=lambda text: int(text.split()[1].rstrip(",:")))
