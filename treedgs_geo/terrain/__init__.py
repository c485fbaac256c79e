"""Ground points, terrain model (DTM), heights above ground."""
