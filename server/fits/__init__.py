"""Fits on request: queueing, execution, and progress."""
