"""Many plots."""
