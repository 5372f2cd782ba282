"""Stored runs as a user finds and opens them."""
