"""Training of the network that tells stems in photos (``treedgs_geo/stems/photos/network/inference.py``)."""
