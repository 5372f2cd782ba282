"""A recording file: content, writing, reading and recovery."""
