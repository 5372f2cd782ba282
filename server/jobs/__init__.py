"""Long work on request, such as studies and fits: queued, followed, cancelled, resumed."""
