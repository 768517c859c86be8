"""Targets with known geometry: chessboards and cross markers, their print, detection and pose."""
