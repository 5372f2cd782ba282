"""The REST interface and the one port on which it and the viewer are served."""
