"""Calibration: intrinsics, the two-board world set-up, hand-eye, and the poses to take them from."""
