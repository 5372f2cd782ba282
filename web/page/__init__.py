"""Additions to viser's page: a script, a style, and routes for its gestures."""
