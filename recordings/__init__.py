"""Runs as MCAP files: writing, reading, storage, comparison, verification and export."""
