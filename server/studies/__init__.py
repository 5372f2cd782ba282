"""Studies on request: queued, run, followed while they run."""
