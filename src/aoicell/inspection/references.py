"""What a view should look like: golden samples, or a virtual image of the design."""

from dataclasses import dataclass

from aoicell.camera import Camera
from aoicell.errors import InputError
from aoicell.inspection.virtual_picture import Drawing
from aoicell.observation import Image
from aoicell.transforms import SE3


@dataclass(frozen=True, eq=False)  # compared by identity: pictures have no use for another equality
class Reference:
    """The standard of a view: grey pictures (H, W) of good boards, taken by the same `camera`.

    `T_camera_board` is the board in the first picture as the calibration estimates it; the others
    may lie a little off it. `virtual`: one picture, drawn from the design by a `Renderer`, whose
    grey values are nobody's. `drawing`: the design as drawn for the first picture, that is the
    shapes of its components and the bare board that a missing one uncovers.
    """

    view: str
    images: tuple[Image, ...]
    T_camera_board: SE3
    camera: Camera
    virtual: bool = False
    drawing: Drawing | None = None

    def __post_init__(self) -> None:
        if not self.images:
            raise InputError(f"reference {self.view}: it holds no picture; give one at least")
        if self.virtual and len(self.images) > 1:
            raise InputError(
                f"reference {self.view}: {len(self.images)} virtual images are alike; give one"
            )
        wanted = (self.camera.height, self.camera.width)
        drawn = {} if self.drawing is None else vars(self.drawing)
        pictures = {f"picture {n}": image for n, image in enumerate(self.images, start=1)}
        pictures |= {f"the drawing's {name}": plane for name, plane in drawn.items()}
        for name, image in pictures.items():
            if image.shape != wanted:
                raise InputError(
                    f"reference {self.view}: {name} is {image.shape}, its camera makes "
                    f"grey ones of {wanted}; give pictures (H, W) of that camera"
                )
