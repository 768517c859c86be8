"""Markers of one board that bear codes: found by what they say, whichever way the board lies.

The code gives a marker's identity and, by the order of its points, its orientation. Where a board
bears a code several times, the layout tells those markers apart. A code that the picture shows
more often than the board bears it is not trusted, nor is one that the board does not bear.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.camera import Camera
from aoicell.errors import Refused, TargetNotFound
from aoicell.targets.layout_gates import consistent, refuse_far, rival_of
from aoicell.targets.located_layout import (
    Layout,
    LayoutConfig,
    LocatedLayout,
    Reading,
    nearest_readings,
    ranked,
)
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.targets.pose import planar_candidates
from aoicell.transforms import SE3

Codes = Mapping[str, str | None]  # of all markers of a board, by id; None for one without


def locate_coded(
    sightings: Sequence[MarkerSighting],
    layout: Layout,
    codes: Codes,
    camera: Camera,
    T_camera_expected: SE3,
    needed: int,
    config: LayoutConfig,
    sigma_px: float | None = None,
) -> LocatedLayout:
    """Pose of a layout of coded markers from their sightings in one picture.

    As `locate_layout`, but for any turn of the board; and for any shift of it, once a marker is
    found whose code the board bears only once. The bounds on lift and tilt hold.

    Raises TargetNotFound, and Refused where the markers contradict each other, could be those of
    two boards, or lie too far from where they are expected.
    """
    found = coded_readings(sightings, layout, codes, camera, T_camera_expected, config)
    uvs = dict(found[0].uvs) if found else {}
    if len(uvs) < needed:
        _refuse_few(uvs, sightings, layout, codes, needed)
    if len(layout) > 1:  # one marker alone is the one nearest to where it is expected
        _refuse_undecided(found)
    located = consistent(uvs, layout, camera, needed, config, sigma_px)
    count = Counter(codes.values())
    if any(count[codes.get(id)] == 1 for id in located.uvs_px):
        config = replace(config, max_shift=np.inf)
    refuse_far(located.T_camera_target, layout, T_camera_expected, config)
    rival = rival_of(found, located, layout, camera, T_camera_expected, config)
    if rival is not None:
        raise _two_boards(rival)
    return located


def coded_readings(
    sightings: Sequence[MarkerSighting],
    layout: Layout,
    codes: Codes,
    camera: Camera,
    T_camera_expected: SE3,
    config: LayoutConfig,
) -> list[Reading]:
    """All ways to read the sightings whose codes are trusted, the best first."""
    trust = _trusted(sightings, codes)
    ids = list(layout)
    possible = np.array(
        [
            [seen.code in trust.codes and seen.code == codes.get(id) for id in ids]
            for seen in sightings
        ]
    ).reshape(len(sightings), len(ids))
    uvs = np.array([seen.uv_px for seen in sightings]).reshape(-1, 4, 2)
    readings = []
    for index, m in np.argwhere(possible):
        points = layout[ids[m]]
        centre = points.mean(axis=0)
        for T_camera_marker in planar_candidates(points - centre, uvs[index], camera):
            T = T_camera_marker * SE3(np.eye(3), -centre)
            indices = nearest_readings(uvs, layout, camera, T, config.max_gap, possible)
            moved = float(np.linalg.norm(T.translation - T_camera_expected.translation))
            if indices:
                readings.append(Reading({id: uvs[k] for id, k in indices.items()}, indices, moved))
    return ranked(readings)


@dataclass(frozen=True)
class _Trust:
    """Codes of a picture: those to go by, those that are there too often, those of no marker."""

    codes: frozenset[str]
    repeated: frozenset[str]
    foreign: frozenset[str]


def _trusted(sightings: Iterable[MarkerSighting], codes: Codes) -> _Trust:
    seen = Counter(sighting.code or "none" for sighting in sightings)
    borne = Counter(code for code in codes.values() if code)
    return _Trust(
        frozenset(code for code in seen if seen[code] <= borne[code]),
        frozenset(code for code in seen if 0 < borne[code] < seen[code]),
        frozenset(code for code in seen if not borne[code]),
    )


# -- Gates ------------------------------------------------------------------------------------


def _refuse_few(
    found: Iterable[str], sightings: Sequence[MarkerSighting], layout: Layout, codes: Codes,
    needed: int,
) -> None:  # fmt: skip
    """Raise, with what the codes say; ambiguous where those that are repeated would be enough."""
    trust, found = _trusted(sightings, codes), set(found)
    missing = [id for id in layout if id not in found]
    told = ["missing: " + ", ".join(f"{id} (code {codes.get(id)})" for id in missing)]
    if trust.repeated:
        told.append(f"more often than on the board: code {_listed(trust.repeated)}")
    if trust.foreign:
        told.append(f"not on the board: code {_listed(trust.foreign)}")
    count = f"{len(found)} of {len(layout)} markers found by their codes, {needed} needed"
    repeated = [id for id in missing if codes.get(id) in trust.repeated]
    if len(found) + len(repeated) >= needed:
        raise Refused(
            f"board: {count} ({'; '.join(told)}), so there may be two boards; take away the "
            "one that is not to be inspected",
            "ambiguous",
        )
    raise TargetNotFound(
        f"board: {count} ({'; '.join(told)}); bring the taught board into view or teach a "
        "higher look-out pose",
        "marker_not_found",
    )


def _refuse_undecided(found: Sequence[Reading]) -> None:
    """Raise where another reading explains as many markers, but not as the same ones."""
    best = found[0].indices
    for reading in found[1:]:
        if len(reading.indices) < len(best):
            return
        both = {**best, **reading.indices}
        if any(both[id] != index for id, index in best.items()) or len(set(both.values())) < len(
            both
        ):
            raise _two_boards(reading)


def _two_boards(reading: Reading) -> Refused:
    return Refused(
        f"board: {', '.join(reading.uvs)} are in the picture as of another board, so there may be "
        "two; take away the one that is not to be inspected",
        "ambiguous",
    )


def _listed(codes: Iterable[str]) -> str:
    return ", ".join(sorted(codes, key=lambda code: (len(code), code)))
