"""The simulated line: boards that arrive, a cell that drifts, and what is true of it all."""
