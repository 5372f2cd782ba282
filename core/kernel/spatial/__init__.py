"""Compiled physics of spatial hands (docs/space.md); imported with the first spatial scenario.

Plant, contact problem and loop differ from those of planar hands: a contact has two slips, friction
is a cone, and the direction of slip changes continuously.
"""
