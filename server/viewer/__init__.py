"""The server of the 3D viewer, and the relay to it on the common port."""
