"""Compiled physics of a body on a support, without a hand; imported with the first such scenario.

The only contact is that of the body with the support. Its normal force is constant, so that the
velocity alone determines the friction.
"""
