"""Topics for Foxglove and Rerun: poses and shapes of hand and object."""
