"""Training of the network that tells stems in photos (``treedgs_geo/from_photos/stem_net.py``)."""
