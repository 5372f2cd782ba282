"""The compiled physics of hands in space (docs/space.md); imported at the first scenario in space.

Its own plant, contact problem and loop beside those of the plane: a contact has two slips, friction
is a cone, and the direction of slip is a state that turns.
"""
