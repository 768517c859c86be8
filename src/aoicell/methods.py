"""Ways through the procedure by name: the project's own, and those that packages bring."""

from aoicell.errors import InputError, did_you_mean
from aoicell.pipeline import METHODS, Method
from aoicell.plugins import load_plugin, plugin_names

GROUP = "aoicell.methods"


def method_names() -> list[str]:
    """All names that a scenario may list."""
    return [*METHODS, *(name for name in plugin_names(GROUP) if name not in METHODS)]


def find_method(name: str) -> Method:
    """The method of a name. Raises InputError for an unknown one or one that is no `Method`."""
    if name in METHODS:
        return METHODS[name]
    if name not in plugin_names(GROUP):
        raise InputError(f"method '{name}': {did_you_mean(name, method_names())}")
    method = load_plugin(GROUP, name)
    if not isinstance(method, Method) or method.name != name:
        raise InputError(
            f"entry point '{name}' of {GROUP}: {method!r} is no aoicell.Method of that name"
        )
    return method
