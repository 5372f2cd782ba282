"""The panels of the dashboard, one class each."""
