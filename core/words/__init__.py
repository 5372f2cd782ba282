"""Text about a run: its outcome, reasons, suggestions and name."""
