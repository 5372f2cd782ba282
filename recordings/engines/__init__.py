"""Scenarios as scenes for other engines, with the expected motion."""
