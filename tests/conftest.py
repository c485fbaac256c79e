"""Shared fixtures. No path games: the library is installed in the environment (``make setup``)."""
