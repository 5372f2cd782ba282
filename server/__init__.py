"""The REST interface and the viewer, on one port."""
