"""Two runs side by side, and one run computed again to verify its recording."""
