"""Stems measured: the default estimator, the published one, heights, and whole clouds."""
