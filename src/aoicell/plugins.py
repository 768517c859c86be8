"""What other packages bring along, found through their entry points.

[project.entry-points."aoicell.methods"]
mine = "my_package:METHOD"          # an aoicell.Method: own localiser, solver or detector

[project.entry-points."aoicell.markers"]
mine = "my_package:MyMarker"        # a marker of another kind, made with (size, pitch)
"""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from aoicell.errors import InputError


def plugin_names(group: str) -> list[str]:
    """Names that installed packages give in an entry point group; nothing is imported."""
    return sorted(_found(group))


@cache
def load_plugin(group: str, name: str) -> Any:
    """What a name stands for. Raises InputError when its package cannot be imported."""
    point = _found(group)[name]
    try:
        return point.load()
    except Exception as error:  # whatever the other package does
        raise InputError(
            f"entry point '{name}' of {group} ({point.value}): it cannot be loaded "
            f"({type(error).__name__}: {error}); mend or remove its package"
        ) from None


@cache
def _found(group: str) -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=group)}
