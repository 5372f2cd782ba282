"""Simulation loop shared by planar and spatial hands: motions, event searches, output."""
