"""The 3D view of the hand, its object and its contacts."""
