"""Where is the board now? One picture from the taught look-out pose tells."""

from dataclasses import dataclass, field

from aoicell.camera import Camera
from aoicell.observation import Observation
from aoicell.registration import Template
from aoicell.targets.layout import LayoutConfig, LocatedLayout, locate_layout


@dataclass(frozen=True)
class LocalizationConfig:
    """`min_markers` of the template have to be found (all, when it has fewer)."""

    min_markers: int = 3
    layout: LayoutConfig = field(default_factory=LayoutConfig)


def localize(
    observation: Observation,
    template: Template,
    camera: Camera,
    config: LocalizationConfig = LocalizationConfig(),
) -> LocatedLayout:
    """The taught markers in a picture taken from the taught look-out pose.

    Raises TargetNotFound when too few are in the picture or they do not fit their layout.
    """
    return locate_layout(
        observation.grey,
        template.layout,
        template.marker,
        camera,
        template.taught.T_camera_target,
        needed=min(config.min_markers, len(template.layout)),
        config=config.layout,
    )
