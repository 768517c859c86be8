"""Run directories of inspecting runs, with records and pictures made by hand."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from benchmark.records_by_hand import stored, trial, view, world

from aoicell.benchmark.records import (
    InspectionRecord,
    PartRecord,
    RegistrationRecord,
    TrialRecord,
)
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.summary import summarise
from aoicell.scenario import Scenario

METHODS = ("uncorrected", "paper", "aoicell")
SIZE = (320, 240)  # px, of the pictures


def part(component: str = "C1", **changes: Any) -> PartRecord:
    """A missing capacitor that was found."""
    values: dict[str, Any] = {
        "component": component, "kind": "capacitor", "planted": "missing", "tolerated": False,
        "width_mm": 2.0, "depth_mm": 1.25, "shift_mm": 0.0, "rotation_deg": 0.0,
        "state": "absent", "called": True, "confidence": 0.98, "shift_error_mm": None,
        "view": "V1", "box_px": [150.0, 110.0, 170.0, 122.0],
    }  # fmt: skip
    return PartRecord(**{**values, **changes})


def escape(component: str = "C2", **changes: Any) -> PartRecord:
    return part(component, state="present", called=False, **changes)


def false_call(component: str = "R7", **changes: Any) -> PartRecord:
    values = {"kind": "resistor", "planted": "", "state": "shifted", "confidence": 0.6}
    return part(component, **{**values, **changes})


def shifted(component: str, by_mm: float, error_mm: float, **changes: Any) -> PartRecord:
    values = {"planted": "shifted", "state": "shifted", "shift_mm": by_mm}
    return part(component, shift_error_mm=error_mm, **{**values, **changes})


def inspected(*parts: PartRecord, **changes: Any) -> InspectionRecord:
    """A board of 100 parts, less what is wrong with it; one view was registered."""
    wrong = sum(bool(p.planted) and not p.tolerated for p in parts)
    values: dict[str, Any] = {
        "verdict": "fail" if any(p.called for p in parts) else "pass",
        "good_components": 100 - wrong, "no_verdict": 0, "unseen": 0, "parts": list(parts),
        "registrations": [RegistrationRecord("V1", "registered", 0.2, 0.3)],
    }  # fmt: skip
    return InspectionRecord(**{**values, **changes})


def board(number: int, method: str, inspection: InspectionRecord, **changes: Any) -> TrialRecord:
    seen = [view(registration.view) for registration in inspection.registrations]
    return trial(number, method, inspection=inspection, **{"views": seen, **changes})


def given_up(number: int, method: str = "uncorrected") -> TrialRecord:
    """A board that lay elsewhere: nothing was said of it."""
    defect = part(state="no_verdict", called=False, confidence=None)
    registration = RegistrationRecord("V1", "no_verdict", None, 80.0)
    nothing = inspected(defect, verdict="no_verdict", no_verdict=100, registrations=[registration])
    return board(number, method, nothing)


def records() -> list[TrialRecord]:
    """Two boards: nothing is seen without a correction, aoicell finds all of it, paper half."""
    good = inspected(part(), shifted("C3", 1.5, 0.02))
    bad = inspected(escape("C1"), shifted("C3", 1.5, 0.4, view="V1"), false_call())
    return [
        record
        for number in range(2)
        for record in (
            given_up(number),
            board(number, "paper", bad if number else good),
            board(number, "aoicell", good),
        )
    ]


def finished(folder: Path, trials: list[TrialRecord], **changes: Any) -> RunStore:
    """A run directory that came to its end, with one world."""
    count = len({record.trial for record in trials})
    values = {
        "name": "s", "seed": 3, "methods": [*METHODS], "worlds": 1, "trials_per_world": count,
        "inspect": True,
    }  # fmt: skip
    scenario = Scenario(**{**values, **changes})
    store = stored(folder, trials, [world(0, 0.03)], scenario)
    store.write_json("summary.json", summarise(scenario, store, 2.5, 0.4))
    return store


def texture(seed: int = 0) -> np.ndarray:
    """A picture (H, W) with structure at all sizes, as a board has."""
    rng = np.random.default_rng(seed)
    picture = np.zeros(SIZE[::-1], np.float32)
    for cells in (6, 15, 40, 100):
        patches = rng.uniform(0, 1, (cells, cells)).astype(np.float32)
        picture += cv2.resize(patches, SIZE, interpolation=cv2.INTER_CUBIC)
    return cv2.normalize(picture, None, 20, 230, cv2.NORM_MINMAX).astype(np.uint8)


def moved(picture: np.ndarray, shift: tuple[float, float], turn_deg: float = 0.0) -> np.ndarray:
    """The picture moved (px) and turned about its middle."""
    middle = ((SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2)
    A = cv2.getRotationMatrix2D(middle, turn_deg, 1.0)
    A[:, 2] += shift
    return cv2.warpAffine(picture, A, SIZE, borderMode=cv2.BORDER_REFLECT)


def add_pictures(store: RunStore, trials: list[TrialRecord]) -> None:
    """A reference for each view, and new pictures of it that lie 3 px off and lack a part."""
    store.images.mkdir(exist_ok=True)
    standard = texture()
    new = standard.copy()
    new[110:122, 150:170] = 255 - new[110:122, 150:170]
    for record in trials:
        for seen in record.views:
            path = store.image_path(record.world, seen.id, record.trial, record.method)
            cv2.imwrite(str(store.image_path(record.world, seen.id)), standard)
            cv2.imwrite(str(path), moved(new, (3.0, -2.0)))


def pictured(folder: Path, trials: list[TrialRecord], **changes: Any) -> RunStore:
    """A finished run that kept its pictures."""
    store = finished(folder, trials, **changes)
    add_pictures(store, trials)
    return store
