"""What is added to viser's page: a script, a style, and the way their gestures come back."""
