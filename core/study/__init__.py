"""A study: a base scenario, and how it varies."""
