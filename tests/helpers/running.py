"""What the shared sessions consist of, and the command line in this process."""

import io
import json
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from aoicell.benchmark.trial import Session
from aoicell.pipeline import CalibrationPictures


@dataclass(frozen=True)
class Rehearsal:
    """A session whose every picture was taken through the fence, and the pictures."""

    session: Session
    pictures: CalibrationPictures


@dataclass(frozen=True)
class Run:
    """A finished command: its folder, what it printed, its exit code."""

    folder: Path
    stdout: str
    stderr: str
    code: int

    @property
    def summary(self) -> dict[str, Any]:
        return dict(json.loads(self.stdout))


def run_cli(*arguments: str | Path, folder: Path = Path()) -> Run:
    """The command line in this process, as a shell would see it."""
    from aoicell import cli  # last: it imports everything

    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        patch.object(sys, "argv", ["aoicell", *map(str, arguments)]),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        try:
            cli.main()
        except SystemExit as done:
            code = int(done.code or 0)
    return Run(folder, out.getvalue(), err.getvalue(), code)
