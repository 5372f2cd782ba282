"""Studies: thousands of runs from one scenario, with their results in one file."""
