"""What a recording's pictures show: each target's points, or the reason why it was not found."""

import os
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.datasets.build import build_target
from aoicell.datasets.pictures import read_picture
from aoicell.datasets.recording import CameraStart, Picture, Recording
from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image, to_grey
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.pairs import sight_pair
from aoicell.targets.sighting import CalibrationTarget, Sighting

_FOCAL_PER_WIDTH = 1.2  # a lens of 45 deg: within a factor of two of most
_MIN_VIEWS = 3  # from which a flat target tells a focal length
_THREADS = 2  # pictures at once: more do not pay beside Python's own part


Seen = tuple[str, str]  # camera, target


@dataclass(frozen=True)
class NamedTarget:
    """A target of a recording by the name that the calibration knows it by, and who sees it."""

    name: str
    cameras: tuple[str, ...]
    target: CalibrationTarget


@dataclass(frozen=True)
class Found:
    """What one view shows: sightings by camera and target, and why others are not among them."""

    sightings: Mapping[Seen, Sighting]
    problems: Mapping[Seen, str]


def named_targets(recording: Recording) -> tuple[NamedTarget, ...]:
    """The recording's targets, each with a name of its own: that given, else its kind."""
    kinds = Counter(d.kind for d in recording.targets if not d.name)
    given = {d.name for d in recording.targets if d.name}
    numbers: Counter[str] = Counter()
    named = []
    for described in recording.targets:
        name = described.name
        if not name:
            numbers[described.kind] += 1
            many = kinds[described.kind] > 1 or described.kind in given
            name = f"{described.kind} {numbers[described.kind]}" if many else described.kind
        cameras = tuple(described.camera or [recording.cameras[0].name])
        named.append(NamedTarget(name, cameras, build_target(described)))
    return tuple(named)


def find_targets(recording: Recording, targets: Sequence[NamedTarget]) -> dict[str, Found]:
    """Each view's sightings by view id, two pictures at a time.

    Raises InputError where nothing tells two targets of one camera apart.
    """
    _check_distinct(targets)

    def look(pictures: Sequence[Picture]) -> Found:
        return _together([_look(picture, targets) for picture in pictures])

    with ThreadPoolExecutor(min(_THREADS, os.cpu_count() or 1)) as pool:
        results = pool.map(look, [view.pictures for view in recording.views])
        return {view.id: found for view, found in zip(recording.views, results, strict=True)}


def _check_distinct(targets: Sequence[NamedTarget]) -> None:
    """Two boards are told apart as a pair; more of them need different layouts."""
    by_camera: dict[str, list[NamedTarget]] = defaultdict(list)
    for target in targets:
        for camera in target.cameras:
            by_camera[camera].append(target)
    for camera, mine in by_camera.items():
        boards = [t for t in mine if isinstance(t.target, Chessboard)]
        if len(boards) > 2:
            raise InputError(
                f"camera '{camera}' sees {len(boards)} chessboards "
                f"({', '.join(t.name for t in boards)}); two at most can be told apart: use "
                "ChArUco or AprilTag for the others"
            )


def _look(picture: Picture, targets: Sequence[NamedTarget]) -> Found:
    """One camera's targets in its picture."""
    mine = [t for t in targets if picture.camera in t.cameras]
    if picture.problem:
        return Found({}, {(picture.camera, t.name): picture.problem for t in mine})
    try:
        image = read_picture(picture.path)
    except TargetNotFound as reason:
        return Found({}, {(picture.camera, t.name): str(reason) for t in mine})
    grey = image if image.ndim == 2 else to_grey(image)
    boards = [t for t in mine if isinstance(t.target, Chessboard)]
    if len(boards) == 2:
        pair = _look_for_pair(grey, boards, picture)
        rest = [_look_for(grey, t, picture) for t in mine if t not in boards]
        parts = [pair, *rest]
    else:
        parts = [_look_for(grey, t, picture) for t in mine]
    return _together(parts)


def _together(parts: Sequence[Found]) -> Found:
    return Found(
        {seen: s for part in parts for seen, s in part.sightings.items()},
        {seen: p for part in parts for seen, p in part.problems.items()},
    )


def _look_for(grey: Image, target: NamedTarget, picture: Picture) -> Found:
    seen = picture.camera, target.name
    try:
        return Found({seen: target.target.sight(grey, str(picture.path))}, {})
    except TargetNotFound as reason:
        return Found({}, {seen: str(reason)})


def _look_for_pair(grey: Image, boards: Sequence[NamedTarget], picture: Picture) -> Found:
    """Two chessboards: both or none, for one alone might be either."""
    first, second = (b.target for b in boards)
    names = [(picture.camera, b.name) for b in boards]
    assert isinstance(first, Chessboard)
    assert isinstance(second, Chessboard)
    try:
        seen = sight_pair(grey, (first, second), str(picture.path))
    except TargetNotFound as reason:
        return Found({}, dict.fromkeys(names, str(reason)))
    return Found(dict(zip(names, seen, strict=True)), {})


def guess_camera(
    start: CameraStart, targets: Sequence[NamedTarget], found: Sequence[Found]
) -> Camera:
    """Intrinsics to start from where a recording has none: by Zhang (2000) from the sightings.

    Without distortion k3; a plain lens of 45 deg where the sightings tell no focal length.
    """
    width, height = start.size
    plain = Camera.pinhole(_FOCAL_PER_WIDTH * width, width, height)
    seen = [(t.target.points, f.sightings[start.name, t.name]) for f in found for t in targets
            if (start.name, t.name) in f.sightings]  # fmt: skip
    if len(seen) < _MIN_VIEWS:
        return plain
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_ASPECT_RATIO
    points = [np.ascontiguousarray(p[s.ids], dtype=np.float32) for p, s in seen]
    pixels = [np.ascontiguousarray(s.uv_px, dtype=np.float32) for _, s in seen]
    try:
        _, K, distortion, _, _ = cv2.calibrateCamera(
            points, pixels, (width, height), np.array(plain.K), np.zeros(5), flags=flags
        )
    except cv2.error:
        return plain
    camera = Camera(
        np.asarray(K, dtype=float), width, height, np.ravel(distortion)[:5].astype(float)
    )
    inside = 0.2 * width < K[0, 2] < 0.8 * width and 0.2 * height < K[1, 2] < 0.8 * height
    sensible = np.isfinite(K).all() and 0.3 < camera.focal_px / width < 20 and inside
    return camera if sensible else plain
