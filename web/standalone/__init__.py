"""A page that simulates: one HTML file with the kernel, the scene and the charts inside."""
