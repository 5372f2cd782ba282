"""Numerical methods: elementary functions, linear algebra, noise, integration methods."""
