"""Pairing and stand tables."""
