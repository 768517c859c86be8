"""The solids that components are made of, and the builder that places them.

Metres and radians, frame `board`; sizes given to the builder are in a component's own frame.
"""

from dataclasses import dataclass

from aoicell.board import Component

Rgba = tuple[float, float, float, float]
Vector = tuple[float, float, float]

BLACK: Rgba = (0.045, 0.045, 0.05, 1)
DARK: Rgba = (0.10, 0.10, 0.11, 1)
GREY: Rgba = (0.30, 0.31, 0.33, 1)
SILVER: Rgba = (0.72, 0.73, 0.75, 1)
TIN: Rgba = (0.80, 0.80, 0.78, 1)
GOLD: Rgba = (0.80, 0.62, 0.22, 1)
WHITE: Rgba = (0.90, 0.89, 0.85, 1)
BLUE: Rgba = (0.08, 0.16, 0.45, 1)
TAN: Rgba = (0.62, 0.49, 0.34, 1)
GREEN: Rgba = (0.05, 0.26, 0.13, 1)


@dataclass(frozen=True)
class Part:
    """A solid: centre and yaw in the board's frame; half_size is (r, r, h/2) for a cylinder.

    On a `printed` part the picture of `label_image` covers the upper side.
    """

    shape: str  # box | cylinder | ellipsoid
    centre: Vector
    yaw: float
    half_size: Vector
    rgba: Rgba
    finish: str = "matte"  # matte | metal | plastic
    printed: bool = False


class PartBuilder:
    """Collects the parts of one component; sizes are full sizes, places are local."""

    def __init__(self, component: Component) -> None:
        self.c = component
        self.parts: list[Part] = []

    def box(
        self, x: float, y: float, z: float, size: Vector, rgba: Rgba, finish: str = "plastic",
        shape: str = "box", printed: bool = False,
    ) -> None:  # fmt: skip
        """A solid whose underside is at z above the component's own underside."""
        centre = (*self.c.place(x, y), self.c.z + z + size[2] / 2)
        half = (size[0] / 2, size[1] / 2, size[2] / 2)
        self.parts.append(Part(shape, centre, self.c.rotation, half, rgba, finish, printed))

    def disk(
        self, x: float, y: float, z: float, diameter: float, height: float, rgba: Rgba,
        finish: str = "metal",
    ) -> None:  # fmt: skip
        """An upright cylinder."""
        self.box(x, y, z, (diameter, diameter, height), rgba, finish, "cylinder")


def spread(length: float, count: int) -> list[float]:
    """Centres of `count` equal cells of a length, about 0."""
    return [length * ((k + 0.5) / count - 0.5) for k in range(count)]
