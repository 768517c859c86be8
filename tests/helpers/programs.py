"""A program written by hand, whose files lie beside the tests."""

from pathlib import Path

from aoicell.planning.program import Capture, Move, Program

FILES = Path(__file__).parents[1] / "data" / "programs"

HOME = (20.0, -8.0, -23.0, 0.0, -59.0, -68.0)
TWO_VIEWS = Program(
    name="two views",
    arm="ra620_1621",
    joints=("joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"),
    start_deg=HOME,
    steps=(
        Move("on the way to V1", (0.0, -8.0, -23.0, 0.0, -59.0, -90.0), 0.5),
        Move("V1", (-20.599982, -6.843918, -27.012912, 12.015856, -54.739575, -122.013517), 0.5),
        Capture("V1"),
        Move("V4", (-13.9, 8.56, -28.686, -3.29, -57.222, -98.9467), 0.4157806535222379),
        Capture("V4"),
        Move("home", HOME, 0.6),
    ),
)
