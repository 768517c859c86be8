"""Calibration: intrinsics, the two-board world set-up, hand-eye, and poses to take them from."""
