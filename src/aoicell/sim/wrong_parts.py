"""What is on the board when the wrong part was taken: another one that can be told from it."""

from dataclasses import replace

import numpy as np

from aoicell.board import BoardDesign, Component
from aoicell.sim.board_geometry import LED_COLOURS, component_parts

SMALLER = 0.8  # one size down: 10, 8, 6.3, 5 mm for cans
LEAST_GREY = 0.15  # difference in brightness by which a grey picture can tell two colours
_CERAMIC = 3e-3  # capacitors are cans from this height (m)


def wrong_part(
    board: BoardDesign, component: Component, rng: np.random.Generator
) -> tuple[Component, str]:
    """The part that is there instead, in the same place, and what it is.

    What bears a print bears another one of its kind; chip resistors and ceramic capacitors are
    taken for each other; lamps, slots and modules are of another colour or capacity; of the
    rest the next smaller size (of connectors one with fewer contacts).
    """
    c = component
    if any(part.printed for part in component_parts(c)):
        label = _another_print(board, c, rng)
        return replace(c, label=label), f"marked {label!r} instead of {c.label!r}"
    if c.kind == "resistor":
        return replace(c, kind="capacitor"), "a ceramic capacitor instead of a resistor"
    if c.kind == "capacitor" and c.height < _CERAMIC:
        return replace(c, kind="resistor"), "a resistor instead of a ceramic capacitor"
    if c.kind == "led":
        colour = _another_colour(c.label, rng)
        return replace(c, label=colour), f"{colour} instead of {c.label}"
    if c.kind == "dimm_slot":
        label = c.label[:-1] + ("2" if c.label.endswith(("1", "3")) else "1")
        return replace(c, label=label), "a slot of the other colour"
    if c.kind == "dimm_module":
        half = "32GB RDIMM" if c.label.startswith("16GB") else "16GB RDIMM"
        return replace(c, label=half), f"{half} instead of {c.label}"
    if c.kind == "connector":
        return replace(c, width=SMALLER * c.width), "fewer contacts"
    smaller = replace(
        c, width=SMALLER * c.width, depth=SMALLER * c.depth, height=SMALLER * c.height
    )
    return smaller, "the next smaller size"


def _another_print(board: BoardDesign, component: Component, rng: np.random.Generator) -> str:
    others = sorted(
        {c.label for c in board.components if c.kind == component.kind and c.label}
        - {component.label}
    )
    return others[int(rng.integers(len(others)))] if others else f"NOT {component.label}"


def _another_colour(colour: str, rng: np.random.Generator) -> str:
    own = _grey(colour)
    others = [name for name in LED_COLOURS if abs(_grey(name) - own) >= LEAST_GREY]
    return others[int(rng.integers(len(others)))]


def _grey(colour: str) -> float:
    """Brightness as ITU-R BT.601 weighs it, and a grey picture does."""
    r, g, b, _ = LED_COLOURS.get(colour, LED_COLOURS["green"])
    return 0.299 * r + 0.587 * g + 0.114 * b
