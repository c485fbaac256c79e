"""Finding stems: in point clouds and straight in the photos; fitting a stem to the photos."""
