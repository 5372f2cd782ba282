"""Studies: thousands of runs from one scenario, their rows in one file."""
