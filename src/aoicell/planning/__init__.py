"""Inspection views from CAD or a scan, whether the arm reaches them, and the program that does."""
