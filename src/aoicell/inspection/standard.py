"""A reference made ready: everything that does not depend on the new picture, computed once."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakKeyDictionary

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import BoardDesign
from aoicell.inspection.absence import Absence, AbsenceConfig
from aoicell.inspection.anchoring import anchored
from aoicell.inspection.bare import bare_board
from aoicell.inspection.foreign import Foreign, ForeignConfig
from aoicell.inspection.half_turn import HalfTurn, HalfTurnConfig
from aoicell.inspection.layers import Layer
from aoicell.inspection.matching import Matcher, NoiseConfig
from aoicell.inspection.planes import Plane
from aoicell.inspection.references import Reference
from aoicell.inspection.registration import (
    Pattern,
    RegistrationConfig,
    pattern_of,
    register,
)
from aoicell.inspection.search import Search, SearchConfig
from aoicell.inspection.shown import BARE, Shown, shown_by
from aoicell.inspection.templates import Template, TemplateConfig, templates_of
from aoicell.inspection.verdicts import VerdictConfig
from aoicell.inspection.virtual_picture import BEYOND, Drawing
from aoicell.inspection.warping import Warp, on_plane
from aoicell.transforms import SE3


@dataclass(frozen=True)
class InspectionConfig:
    """What the steps of an inspection go by."""

    registration: RegistrationConfig = field(default_factory=RegistrationConfig)
    template: TemplateConfig = field(default_factory=TemplateConfig)
    noise: NoiseConfig = field(default_factory=NoiseConfig)
    search: SearchConfig = field(default_factory=SearchConfig)
    absence: AbsenceConfig = field(default_factory=AbsenceConfig)
    foreign: ForeignConfig = field(default_factory=ForeignConfig)
    half_turn: HalfTurnConfig = field(default_factory=HalfTurnConfig)
    verdict: VerdictConfig = field(default_factory=VerdictConfig)


@dataclass(frozen=True)
class Tools:
    """What looks for one component."""

    template: Template
    matcher: Matcher
    search: Search
    absence: Absence
    half_turn: HalfTurn | None


@dataclass(frozen=True, eq=False)
class Standard:
    """A view's reference, ready to be compared with. `mean` (H, W) of its pictures; `shown` what
    they show; `T_camera_board` where the design lies in them.
    """

    view: str
    board: BoardDesign
    mean: Plane
    shown: Shown
    T_camera_board: SE3
    pattern: Pattern
    warp: Warp
    tools: Mapping[str, Tools]
    foreign: Foreign
    config: InspectionConfig


def standard_of(reference: Reference, board: BoardDesign, config: InspectionConfig) -> Standard:
    """The reference of a board made ready; kept as long as the reference is."""
    known = _STANDARDS.setdefault(reference, [])
    for standard in known:
        if standard.board is board and standard.config == config:
            return standard
    known.append(_made(reference, board, config))
    return known[-1]


_STANDARDS: WeakKeyDictionary[Reference, list[Standard]] = WeakKeyDictionary()


def _made(reference: Reference, board: BoardDesign, config: InspectionConfig) -> Standard:
    grey, camera = reference.images[0], reference.camera
    shown = shown_by(board, camera, reference.T_camera_board)
    T = anchored(grey, board, camera, reference.T_camera_board, shown)
    drawing = _drawing(reference, T)
    shown = shown_by(board, camera, T, drawing)
    pattern = pattern_of(grey, shown, camera, T, config.registration)
    warp = Warp(camera, T, shown)
    mean, spread = _golden(reference, pattern, warp)
    templates = templates_of(mean, spread, shown, board, camera, T, config.template)
    bare = bare_board(drawing, mean, shown) if drawing else None
    tools = {}
    for id, template in templates.items():
        layer, tolerance = Layer(template, mean, bare, shown), board.tolerance(template.component)
        matcher = Matcher(template, layer, tolerance, config.noise)
        tools[id] = Tools(
            template,
            matcher,
            Search(template, mean, config.search),
            Absence(template, shown, config.absence, bare),
            HalfTurn(template, matcher.jacobian, drawing, config.half_turn)
            if drawing and tolerance.rotation < np.pi
            else None,
        )
    foreign = Foreign(mean, spread, shown.numbers, _covered(shown), config.foreign)
    return Standard(reference.view, board, mean, shown, T, pattern, warp, tools, foreign, config)


def _drawing(reference: Reference, T: SE3) -> Drawing | None:
    """The drawing, moved to where the design lies in the reference, by the laminate's plane."""
    drawn, camera = reference.drawing, reference.camera
    if drawn is None:
        return None
    u, v = np.meshgrid(np.linspace(0, camera.width, 7), np.linspace(0, camera.height, 7))
    uv = np.column_stack([u.ravel(), v.ravel()])
    drawn_at = camera.project(on_plane(uv, 0.0, camera, T), reference.T_camera_board)
    H, _ = cv2.findHomography(uv, drawn_at)
    size = (camera.width, camera.height)

    def carried(plane: NDArray[Any], how: int, border: int = 0) -> NDArray[Any]:
        flags = how | cv2.WARP_INVERSE_MAP
        return cv2.warpPerspective(plane, H, size, flags=flags, borderValue=(border,))

    return Drawing(
        carried(drawn.designed, cv2.INTER_LINEAR),
        carried(drawn.turned, cv2.INTER_LINEAR),
        carried(drawn.bare, cv2.INTER_LINEAR),
        carried(drawn.numbers, cv2.INTER_NEAREST, BEYOND),
        carried(drawn.heights, cv2.INTER_NEAREST),
    )


def _golden(reference: Reference, pattern: Pattern, warp: Warp) -> tuple[Plane, Plane]:
    """Mean and spread (H, W) of the golden samples, in the pixels of the first.

    One sample has no spread; with few, that of all pixels about a place speaks for each.
    """
    planes = [reference.images[0].astype(np.float32)]
    for image in reference.images[1:]:
        registration = register(image, pattern, reference.camera)
        if registration.state == "no_verdict":
            continue
        plane = warp(image, registration)
        planes.append(np.where(np.isnan(plane), planes[0], plane))
    if len(planes) == 1:
        return planes[0], np.zeros_like(planes[0])
    stack = np.stack(planes)
    variance = cv2.blur(stack.var(axis=0, ddof=1), (3, 3))
    return np.asarray(stack.mean(axis=0), np.float32), np.asarray(np.sqrt(variance), np.float32)


def _covered(shown: Shown) -> NDArray[np.bool_]:
    """Where (H, W) components are, and the blur about them."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _BLUR_PX + 1,) * 2)
    return cv2.dilate((shown.numbers >= 0).astype(np.uint8), disc).astype(bool)


def gain_of(picture: Plane, standard: Standard) -> float:
    """How many times brighter a picture is than the reference, by the bare board."""
    step = (slice(None, None, 4), slice(None, None, 4))
    bare = standard.shown.numbers[step] == BARE
    ratios = picture[step][bare] / np.maximum(standard.mean[step][bare], 1)
    return max(float(np.nanmedian(ratios)), _DARKEST) if len(ratios) else 1.0


def grey_noise(picture: Plane, standard: Standard) -> float:
    """Variance of the difference of two pictures of the bare board, a grey value of light."""
    step = (slice(None, None, 4), slice(None, None, 4))
    bare = standard.shown.numbers[step] == BARE
    mean = standard.mean[step][bare]
    difference = picture[step][bare] - mean
    difference = difference[np.isfinite(difference)]
    if not len(difference):
        return _QUIET
    middle = np.median(difference)
    sigma = 1.4826 * float(np.median(np.abs(difference - middle)))
    return max(sigma**2 / (float(np.median(mean)) + 5.0), _QUIET)


_BLUR_PX = 3
_DARKEST = 0.1  # of the reference's light
_QUIET = 2 / 12 / 30  # two pictures' rounding to whole grey values
