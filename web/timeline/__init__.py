"""The play head: where it stands, what happens around it, and how it is moved."""
