"""Virtual images of inspection views: what each would show if all were as designed."""

from collections.abc import Iterable, Iterator

from aoicell.nominal import View
from aoicell.observation import Image, Renderer
from aoicell.transforms import SE3


def virtual_images(
    renderer: Renderer, views: Iterable[View], T_base_board: SE3
) -> Iterator[tuple[View, Image]]:
    """Each view with its picture of the board as it lies at `T_base_board`."""
    for view in views:
        yield view, renderer.render(T_base_board * view.T_target_camera, T_base_board)
