"""Experiments behind the figures of the docs; the index is README.md. Not part of the library."""
