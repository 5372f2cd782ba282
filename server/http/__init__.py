"""What every route shares: access, limits, bodies, errors, pages, downloads, OpenAPI."""
