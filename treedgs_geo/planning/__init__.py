"""What to fly for a wanted error: stand, terrain and camera in, the flight with the fewest photos out."""
