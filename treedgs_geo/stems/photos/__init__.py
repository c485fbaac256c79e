"""Stems found and fitted straight in the photos, without any dense cloud."""
