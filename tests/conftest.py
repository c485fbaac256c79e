"""Shared fixtures. No path games: the library is installed in the environment (``make setup``)."""

from hypothesis import HealthCheck, settings

# Machines are noisy: no test may fail because it was slow.
settings.register_profile("noisy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("noisy")
