"""A cell that is the protocol and nothing else."""

from typing import Any

from aoicell.observation import Cell

PROTOCOL = ("move", "state", "capture")


def fenced(cell: Cell) -> Any:
    """A stand-in for `cell` that raises when anything but the protocol is asked for."""

    class Fence:
        __slots__ = ()

        def __getattribute__(self, name: str) -> Any:
            if name not in PROTOCOL:
                raise AssertionError(f"the cell was asked for {name!r}: not in the protocol")
            # a plain function: a bound method would hand out the cell as __self__
            return lambda *args, **kwargs: getattr(cell, name)(*args, **kwargs)

    return Fence()
