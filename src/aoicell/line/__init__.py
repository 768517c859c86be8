"""The station of a line: boards one after the other, with an eye on what drifts.

Knows the `Cell` protocol only; the simulated conveyor and the truth are in `benchmark.line`.
"""
