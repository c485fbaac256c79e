"""Whole runs: the same again, and cancelled."""
