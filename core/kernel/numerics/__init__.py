"""Arithmetic of the kernel: elementary functions, linear algebra, noise, integration methods."""
