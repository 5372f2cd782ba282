"""Studies on request: queue, execution, progress."""
