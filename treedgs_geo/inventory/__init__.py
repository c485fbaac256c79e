"""Tree layers, field plots, pairing, stand tables."""
