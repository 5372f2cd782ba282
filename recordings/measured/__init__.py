"""Recordings of measured data."""
