"""Planar hands: kinematics, dynamics, contact phases, guards and the loop around them."""
