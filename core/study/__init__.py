"""Studies: a base scenario and its variations."""
