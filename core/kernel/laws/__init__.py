"""Common parts of the control laws of planar and spatial hands."""
