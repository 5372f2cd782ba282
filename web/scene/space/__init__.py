"""The picture of a hand in space."""
