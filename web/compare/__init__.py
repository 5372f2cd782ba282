"""Two runs side by side: what tells them apart."""
