"""Compiled physics of a finger that moves an object along a rail.

Imported with the first such scenario. Contact 0 is the fingertip, contact 1 the rail. The
kinematics and dynamics of the finger are those of planar hands.
"""
