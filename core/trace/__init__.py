"""What happened in a run: its signals over time, as arrays, named columns and frames."""
