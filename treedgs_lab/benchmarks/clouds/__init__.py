"""From point clouds to diameters."""
