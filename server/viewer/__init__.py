"""The server of the 3D viewer, and the relay that lets its frames through the one port."""
