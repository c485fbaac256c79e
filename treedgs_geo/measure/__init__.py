"""Stem points -> slices, circles, taper, DBH with an error and a reason."""
