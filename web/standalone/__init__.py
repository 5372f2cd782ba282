"""Live pages: one HTML file with kernel, scene and charts."""
