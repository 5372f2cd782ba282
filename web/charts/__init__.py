"""Content and drawing of the charts."""
