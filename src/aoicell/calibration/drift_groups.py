"""What may have changed since a calibration: groups of parameters, and changes in words."""

import numpy as np

from aoicell.calibration.drift_reference import Reference
from aoicell.calibration.drift_statistics import ChangeTest, columns, tail
from aoicell.calibration.observability import natural_steps
from aoicell.calibration.parameters import Layout
from aoicell.transforms import Array

CAMERA, FOCAL, CENTRE, BOTH = (
    "camera on its mount", "focal length", "principal point", "camera and lens"
)  # fmt: skip
PRINT, TARGET, ARM = "print of the target", "target or robot base", "robot"
EVERYTHING = "anything"


def change_groups(layout: Layout, reference: Reference) -> dict[str, tuple[Array, Array]]:
    """Directions (P, k) of each group and their natural steps (k,)."""
    P = layout.size
    eye = layout.blocks["eye", reference.eye]
    knock = columns(P, range(eye.start, eye.stop))
    groups = {CAMERA: (knock, np.full(6, 1e-3))}
    if reference.camera is not None:
        first = layout.blocks["intrinsics", reference.eye].start
        focal = np.zeros((P, 1))
        focal[first : first + 2, 0] = np.diag(reference.camera.K)[:2]  # a relative change
        centre = columns(P, [first + 2, first + 3])
        groups[FOCAL] = (focal, np.full(1, 1e-3))
        groups[CENTRE] = (centre, np.ones(2))
        scale = np.r_[np.full(7, 1e-3), 1.0, 1.0]
        groups[BOTH] = (np.hstack([knock, focal, centre]), scale)
    printed = [
        index
        for (kind, name), where in layout.blocks.items()
        if kind in ("scale", "form") and name in reference.T_mount_fixture
        for index in range(where.start, where.stop)
    ]
    if printed:
        groups[PRINT] = (columns(P, printed), natural_steps(layout)[printed])
    common = _base_twist(layout, reference)
    if common is not None:
        groups[TARGET] = (common, np.full(6, 1e-3))
    return groups


def _base_twist(layout: Layout, reference: Reference) -> Array | None:
    """How a common motion of what carries the targets moves each of them (P, 6)."""
    D = np.zeros((layout.size, 6))
    for name, T in reference.T_mount_fixture.items():
        if ("fixture", name) in layout.blocks:
            D[layout.blocks["fixture", name]] = T.toActionMatrixInverse()
    return D if D.any() else None


def sentence_of(test: ChangeTest) -> str:
    """What changed and by how much, for people."""
    std, values = np.sqrt(np.diag(test.covariance)), test.values
    parts = []
    if test.name in (CAMERA, BOTH, TARGET):
        parts += [_size("moved", values[:3] * 1e3, std[:3] * 1e3, "mm")]
        parts += [_size("turned", np.degrees(values[3:6]), np.degrees(std[3:6]), "deg")]
    if test.name in (FOCAL, BOTH):
        at = 6 if test.name == BOTH else 0
        parts += [f"focal length {100 * values[at]:+.3f} +/- {100 * std[at]:.3f} %"]
    if test.name in (CENTRE, BOTH):
        parts += [_size("principal point moved", values[-2:], std[-2:], "px")]
    if test.name == PRINT:
        parts += ["another one, or it has bent"]
    left = "" if test.complete else "; the views do not tell all of it"
    return f"{test.name}: {', '.join(parts)}{left}"


def _size(what: str, values: Array, std: Array, unit: str) -> str:
    """Length of a vector with the standard deviation along it."""
    length = float(np.linalg.norm(values))
    along = float(np.linalg.norm(std * values / length)) if length > 0 else float(std.max())
    return f"{what} {length:.3f} +/- {along:.3f} {unit}"


def alarms_among(tests: tuple[ChangeTest, ...], significance: float) -> list[ChangeTest]:
    """Tests that chance does not explain, all of them together at the stated significance."""
    asked = [t for t in tests if t.freedoms > 0]
    return [t for t in asked if t.p < significance / len(asked)]


def best_of(
    tests: tuple[ChangeTest, ...], noise_freedoms: float, significance: float
) -> ChangeTest | None:
    """The change that explains an alarm best: chi-square less two a degree (Akaike 1974).

    Camera and lens together only where neither is enough.
    """
    if not alarms_among(tests, significance):
        return None
    single = [t for t in tests if t.name not in (EVERYTHING, BOTH) and t.freedoms > 0]
    best = max(single, key=_merit)
    both = next((t for t in tests if t.name == BOTH), best)
    gain, more = both.chi_square - best.chi_square, both.freedoms - best.freedoms
    enough = more <= 0 or tail(gain, more, noise_freedoms) > significance
    return best if enough else both


def _merit(test: ChangeTest) -> float:
    return test.chi_square - 2 * test.freedoms


def rivals_of(tests: tuple[ChangeTest, ...], chosen: ChangeTest | None) -> tuple[str, ...]:
    """Other explanations less than e^3 times less likely."""
    if chosen is None:
        return ()
    others = [t for t in tests if t.name not in (chosen.name, EVERYTHING, ARM, BOTH)]
    return tuple(t.name for t in others if t.freedoms and _merit(t) > _merit(chosen) - 6)
