"""Accuracy against field or true DBH."""
