"""From photos to diameters."""
