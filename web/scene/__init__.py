"""The picture of the hand, its object and its contacts."""
