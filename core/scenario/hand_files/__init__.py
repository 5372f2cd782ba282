"""Hands in URDF and MJCF files, converted to the fingers of a scenario."""
