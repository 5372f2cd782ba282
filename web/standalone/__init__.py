"""A page that simulates: one HTML file with kernel, scene and charts."""
