"""Runs as MCAP files: written, read back, kept in a folder, compared, verified and exported."""
