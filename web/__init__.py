"""The dashboard: a viewer that shows runs and lets a user change them."""
