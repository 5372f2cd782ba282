"""What the control laws of both mechanics share."""
