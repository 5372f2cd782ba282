"""Long jobs on request, such as studies and fits: queueing, progress, cancelling, resuming."""
