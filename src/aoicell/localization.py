"""Where is the board now? One picture from the taught look-out pose tells."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from aoicell.camera import Camera
from aoicell.observation import Observation
from aoicell.registration import Template
from aoicell.targets.layout import Codes, LayoutConfig, LocatedLayout, locate_layout
from aoicell.targets.marker_sighting import Detection
from aoicell.transforms import Array


@dataclass(frozen=True)
class LocalizationConfig:
    """`min_markers` of the template have to be found (all, when it has fewer)."""

    min_markers: int = 3
    layout: LayoutConfig = field(default_factory=LayoutConfig)


class Localizer(Protocol):
    """Locates the taught board in a picture that was taken from the look-out pose."""

    def __call__(
        self,
        observation: Observation,
        detections: Sequence[Array],
        template: Template,
        camera: Camera,
    ) -> LocatedLayout:
        """The template's frame in the camera, from the picture or from the marker-like detections
        (4, 2) px in it. Raises Refused when it cannot be told.
        """


def stay(
    observation: Observation,
    detections: Sequence[Array],
    template: Template,
    camera: Camera,
) -> LocatedLayout:
    """The board where it was taught, whatever the picture shows: no correction at all."""
    return template.taught


def localize(
    observation: Observation,
    detections: Sequence[Detection],
    template: Template,
    camera: Camera,
    config: LocalizationConfig = LocalizationConfig(),
    codes: Codes | None = None,
) -> LocatedLayout:
    """The taught markers among the detections of a picture from the look-out pose.

    Points (4, 2) px do where the markers are plain; with the `codes` of all markers of the board,
    by id, sightings are needed, and the board may lie any way round.

    Raises TargetNotFound when too few are in the picture, and Refused when they do not fit their
    layout or the board is not where it may be; see `locate_layout`.
    """
    return locate_layout(
        detections,
        template.layout,
        camera,
        template.taught.T_camera_target,
        needed=min(config.min_markers, len(template.layout)),
        config=config.layout,
        # one marker alone was not measured in its layout, and its print may be off
        sigma_px=template.sigma_px if len(template.layout) > 1 else None,
        codes=codes,
    )
