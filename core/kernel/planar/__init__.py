"""Planar hands: kinematics, dynamics, contact phases, guards and simulation loop."""
