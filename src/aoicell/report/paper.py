"""What the paper prints (Sensors 2021, 21(12), 4071), and where it contradicts itself."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PrintedTest:
    """One of the paper's two tests, as printed."""

    moved_mm: float
    left_mm: float
    compensated_percent: float


TESTS = (PrintedTest(49.1, 5.15, 91.5), PrintedTest(50.6, 3.80, 92.5))
MEAN_MM = 3.97
MEAN_PX = 21.09
HAND_EYE_X_MM = 9.0
HAND_EYE_Z_MM = 2.0


def contradictions() -> str:
    """What does not follow from the paper's own residuals, computed from them."""
    first, second = TESTS
    follows = 100 * (1 - first.left_mm / first.moved_mm)
    mean = (first.left_mm + second.left_mm) / 2
    return (
        "The paper's figures stand as printed. They do not all follow from each other: "
        f"{first.left_mm} mm of {first.moved_mm} mm are {follows:.1f} % compensated, not "
        f"{first.compensated_percent} %; the mean of {first.left_mm} and {second.left_mm:.2f} mm "
        f"is {mean:.3f} mm, while it prints {MEAN_MM} mm, the mean over its points."
    )
