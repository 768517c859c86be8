"""Other readings of a recording with pictures: its targets found first, then each reading tried.

A board that looks the same after a half turn is read as each reading's own arm poses want it.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from aoicell.calibration.half_turns import settle_half_turns
from aoicell.calibration.problem import Problem, moves, pairs_seen, sights_of
from aoicell.calibration.starts import (
    SightPoses,
    corners_of,
    pair_motion,
    sight_poses,
    solve_pair,
)
from aoicell.datasets.manifest import manifest_values
from aoicell.datasets.readings import variants
from aoicell.datasets.recording import Recording, assemble
from aoicell.datasets.solve import detect
from aoicell.datasets.suggest import Reading, any_reading, suggest
from aoicell.errors import Implausible, InputError, Refused
from aoicell.transforms import SE3

_STRAY = 6.0  # a view further from where most have the target than so many usual distances
_MOST_STRAYS = 0.25  # of the views; with more, the reading is wrong, not the views


def suggest_readings(path: Path) -> list[Reading]:
    """All readings of a manifest, the most consistent first; nothing is decided or changed.

    Raises InputError where nothing can be read, Refused where no picture shows the target.
    """
    recording = any_reading(path)
    if not recording.targets:
        return suggest(path)
    posed = sight_poses(_first_target(detect(recording).problem))
    if not posed.poses:
        raise Refused(
            f"{path}: no picture shows the target, so no reading can be tried; check its kind, "
            "its counts and the pictures"
        )
    best: dict[tuple[str, ...], Reading] = {}
    for seen in _settled(path, posed.problem, posed.poses):
        for reading in suggest(path, seen):
            known = best.get(reading.changes)
            if known is None or reading.scatter_mm < known.scatter_mm:
                best[reading.changes] = reading
    return sorted(
        best.values(), key=lambda r: (round(r.scatter_mm, 6), len(r.changes), r.mounted_mm)
    )


def _first_target(problem: Problem) -> Problem:
    """The first target alone, with the camera before which the arm moves it."""
    seen = pairs_seen(problem)
    if not seen:
        return problem
    mine = [pair for pair in seen if pair[1].name == problem.fixtures[0].name] or seen
    eye, fixture = next((pair for pair in mine if moves(*pair)), mine[0])
    views = [
        replace(
            view,
            sights=tuple(s for s in view.sights if (s.eye, s.fixture) == (eye.name, fixture.name)),
        )
        for view in problem.views
    ]
    return Problem((eye,), (fixture,), tuple(views), problem.arm)


def _settled(path: Path, problem: Problem, poses: SightPoses) -> list[Mapping[str, SE3]]:
    """The first target's poses as the arm poses of each different reading settle half turns."""
    tried: list[Mapping[str, SE3]] = []
    done: set[tuple[object, ...]] = set()
    for variant in variants(path, manifest_values(path)):
        views = variant.manifest.views
        inverted = (variant.mount == "eye_to_hand") != (views.pose_meaning == "T_flange_base")
        key = (inverted, getattr(views, "pose_format", ""), getattr(views, "pairing", ""))
        if key in done:
            continue
        try:
            recording = assemble(path, variant.manifest, check_lengths=False)
        except InputError:
            continue  # this reading has no answer; `suggest` says why
        done.add(key)
        read = settle_half_turns(_with_arm(problem, recording, variant.mount), poses)
        tried.append(_agreeing(read.problem, read.poses))
    return tried


def _agreeing(problem: Problem, poses: SightPoses) -> dict[str, SE3]:
    """The first target's poses by view id, a few views that stray far from the others left out.

    Closed forms trust every view alike: one false detection hides the right reading.
    """
    eye, fixture = pairs_seen(problem)[0]
    ids = [problem.views[v].id for v, _ in sights_of(problem, eye, fixture)]
    As, Bs = pair_motion(problem, poses, eye, fixture)
    seen = dict(zip(ids, Bs, strict=True))
    try:
        start = solve_pair(As, Bs, corners_of(fixture))
    except Implausible:
        return seen
    strays = start.gaps > _STRAY * start.typical_gap
    if strays.mean() > _MOST_STRAYS:
        return seen
    return {id: T for (id, T), stray in zip(seen.items(), strays, strict=True) if not stray}


def _with_arm(problem: Problem, recording: Recording, mount: str) -> Problem:
    """The problem with the arm poses, and the mount, of another reading."""
    arm = {view.id: view.T_base_flange for view in recording.views}
    views = [replace(v, T_base_flange=arm.get(v.id, v.T_base_flange)) for v in problem.views]
    in_hand = mount == "eye_in_hand"
    eyes = tuple(replace(e, mount="flange" if in_hand else "base") for e in problem.eyes)
    fixtures = tuple(replace(f, mount="base" if in_hand else "flange") for f in problem.fixtures)
    return Problem(eyes, fixtures, tuple(views))
