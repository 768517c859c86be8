"""How the solids of a component are turned: upright on one end, and into what looks the same."""

from collections.abc import Iterable
from dataclasses import replace

from aoicell.board import Component
from aoicell.errors import InputError
from aoicell.sim.board_geometry import component_parts
from aoicell.sim.board_solids import Part


def upright(component: Component, end: int) -> Component:
    """The room that a chip part takes when it stands on its +x or -x end (1 or -1).

    That end is soldered: it stands in the middle of its pad, the other end is up.
    """
    x, y = component.place(end * component.width / 2, 0)
    return replace(component, x=x, y=y, width=component.height, height=component.width)


def upright_parts(component: Component, end: int) -> tuple[Part, ...]:
    """The solids of a component that stands like that.

    Raises InputError for a part that does not consist of blocks.
    """
    parts = []
    for part in component_parts(replace(component, x=0.0, y=0.0, z=0.0, rotation=0.0)):
        if part.printed or part.shape == "cylinder":
            raise InputError(
                f"component {component.id}: a {component.kind} of this size does not stand "
                "upright; only chip parts do"
            )
        (x, y, z), (hx, hy, hz) = part.centre, part.half_size
        across = end * (component.width / 2 + z - component.height / 2)
        up = component.z + component.width / 2 - end * x
        parts.append(
            replace(
                part,
                centre=(*component.place(across, y), up),
                half_size=(hz, hy, hx),
                yaw=component.rotation,
            )
        )
    return tuple(parts)


def looks_alike(component: Component) -> int:
    """In how many ways, by equal turns about its upright axis, a component looks the same: 1, 2, 4.

    A half turn of a part that looks alike in 2 ways is nothing that anyone could see. Taken from
    its solids; what bears a print looks like itself in one way only.
    """
    parts = component_parts(replace(component, x=0.0, y=0.0, z=0.0, rotation=0.0))
    if any(part.printed for part in parts):
        return 1
    alike = [ways for ways in (2, 4) if _solids(parts) == _solids(_turned(parts, ways))]
    return max(alike, default=1)


def _turned(parts: Iterable[Part], ways: int) -> list[Part]:
    """Parts with their sides along x and y, after a half (2) or a quarter turn (4)."""
    turned = []
    for part in parts:
        (x, y, z), (hx, hy, hz) = part.centre, part.half_size
        centre, half = ((-x, -y, z), (hx, hy, hz)) if ways == 2 else ((-y, x, z), (hy, hx, hz))
        turned.append(replace(part, centre=centre, half_size=half))
    return turned


def _solids(parts: Iterable[Part]) -> list[tuple[object, ...]]:
    """What can be compared, to 10 nm; adding 0 makes -0 the same as 0."""
    keys = [
        (p.shape, p.finish, p.rgba, *(round(v, 8) + 0.0 for v in (*p.centre, *p.half_size)))
        for p in parts
    ]
    return sorted(keys, key=repr)
