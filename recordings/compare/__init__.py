"""Comparison of two runs, and verification of a recording by a new simulation."""
