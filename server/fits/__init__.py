"""Fits on request: queued, run, followed while they run."""
