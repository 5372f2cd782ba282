"""What is asked for: scenarios, edits, their runs, and what is said of these."""
