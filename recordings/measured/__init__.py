"""Measured data as recordings: what a sensor gave, without a simulation."""
