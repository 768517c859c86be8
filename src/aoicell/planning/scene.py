"""The scene that views are planned for: the board as designed, the lamps of the room, the lens."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from aoicell.errors import ModelError
from aoicell.nominal import Nominal
from aoicell.planning.coverage import Limits, Scene
from aoicell.planning.heights import heights_of
from aoicell.planning.targets import Hidden, features_of
from aoicell.transforms import Array, apply

_FAR = 100.0  # where a lamp stands whose rays are parallel (m)


def board_scene(nominal: Nominal, limits: Limits | None = None) -> tuple[Scene, list[Hidden]]:
    """The scene of a component list, and what is built over. Raises ModelError."""
    field = heights_of(nominal.board)
    features, hidden = features_of(nominal.board, field)
    camera = nominal.cameras["hand"]
    return Scene(features, field, camera, lamps_of(nominal), limits or Limits()), hidden


def lamps_of(nominal: Nominal) -> Array:
    """Where the room's lamps hang by design, (L, 3) in the frame `board`, from `cell.xml`.

    The light that goes with the camera is no lamp: it has no highlights there.
    """
    room = nominal.folder / "cell.xml"
    T_world_board = nominal.T_world_base * nominal.T_base_board
    return apply(T_world_board.inverse(), _lamps(room))


def _lamps(room: Path) -> Array:
    try:
        lights = ElementTree.parse(room).getroot().iter("light")
        return np.array([_place(light) for light in lights]).reshape(-1, 3)
    except (OSError, ValueError, ElementTree.ParseError) as error:
        reason = " ".join(str(error).split())
        raise ModelError(f"{room}: its lamps cannot be read: {reason}") from None


def _place(light: ElementTree.Element) -> Array:
    """A lamp's place (3,) in the world; MuJoCo's defaults where the file says nothing."""

    def vector(name: str, default: str) -> Array:
        return np.array([float(value) for value in light.get(name, default).split()])

    if light.get("type") == "directional" or light.get("directional") == "true":
        direction = vector("dir", "0 0 -1")
        return np.asarray(-_FAR * direction / np.linalg.norm(direction))
    return vector("pos", "0 0 0")
