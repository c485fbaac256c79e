"""A flight as the files that drones and ground stations read."""
