"""Single runs on request: simulated, stored, found."""
