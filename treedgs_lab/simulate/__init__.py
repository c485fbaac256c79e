"""Synthetic plots by ray casting: photos, PPK files, LiDAR, field table, truth."""
