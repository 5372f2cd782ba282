"""Common HTTP code of all routes: access, limits, bodies, errors, pages, downloads, OpenAPI."""
