"""A scenario as a stage in the text form of USD, with the schemas of UsdPhysics.

No engine has simulated these stages: they are checked as files. Lengths are metres, masses
kilograms; a joint position is zero if the frames of both bodies coincide, as here.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.engines.bodies import (
    LEAST_MASS,
    Chain,
    Floats,
    Frame,
    Link,
    Shape,
    chains_of,
)

_TYPES = {"hinge": "PhysicsRevoluteJoint", "slide": "PhysicsPrismaticJoint"}
_UNTURNED = (1.0, 0.0, 0.0, 0.0)
_HALF_TURN = (0.0, 1.0, 0.0, 0.0)  # about x, reverses the axis of joints that turn about -y


def describe_scene(scenario: Scenario, angles: Floats) -> str:
    """The stage in the start pose.

    Args:
        scenario: The hand and its object.
        angles: Joint positions of the start pose [rad, m].
    """
    roughest = max(finger.friction for finger in scenario.fingers)
    chains = "".join(_chain(chain, roughest) for chain in chains_of(scenario, angles))
    return f"""#usda 1.0
(
    defaultPrim = "grasp"
    kilogramsPerUnit = 1
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "grasp"
{{
    def PhysicsScene "physics"
    {{
        vector3f physics:gravityDirection = (0, 0, -1)
        float physics:gravityMagnitude = {scenario.simulation.gravity}
    }}
{chains}}}
"""


def _chain(chain: Chain, roughest: float) -> str:
    """A group of bodies and joints; the object has the largest friction of all fingertips."""
    shapes = "".join(_shape(shape, roughest) for shape in chain.shapes)
    bodies, joints, parent = "", "", ""
    for link, frame in zip(chain.links, chain.frames, strict=True):
        body = f"</grasp/{chain.name}/{link.name}>"
        bodies += _body(link, frame, shapes if link is chain.links[-1] else "")
        joints += "" if link.kind == "free" else _joint(link, parent, body)
        parent = f"\n            rel physics:body0 = {body}"
    schemas = '(prepend apiSchemas = ["PhysicsArticulationRootAPI"])' if joints else ""
    return f"""
    def Xform "{chain.name}" {schemas}
    {{{bodies}{joints}
    }}
"""


def _body(link: Link, frame: Frame, shapes: str) -> str:
    return f"""
        def Xform "{link.name}" (
            prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]
        )
        {{
            float physics:mass = {link.mass or LEAST_MASS}
            point3f physics:centerOfMass = {_tuple(link.centre)}
            float3 physics:diagonalInertia = {_tuple(link.inertias)}
            quatf physics:principalAxes = {_UNTURNED}
            {_placed(frame, np.ones(3))}{shapes}
        }}"""


def _shape(shape: Shape, roughest: float) -> str:
    """A collider; PhysX uses the smaller of two frictions, which is that of the fingertip."""
    friction = roughest if shape.friction is None else shape.friction
    is_box = shape.friction is None
    return f"""
            def Material "{shape.name}_friction" (
                prepend apiSchemas = ["PhysicsMaterialAPI", "PhysxMaterialAPI"]
            )
            {{
                float physics:dynamicFriction = {friction}
                float physics:staticFriction = {friction}
                float physics:restitution = 0
                uniform token physxMaterial:frictionCombineMode = "min"
            }}
            def {"Cube" if is_box else "Sphere"} "{shape.name}" (
                prepend apiSchemas = ["PhysicsCollisionAPI", "MaterialBindingAPI"]
            )
            {{
                double {"size = 2" if is_box else f"radius = {float(shape.sizes[0])}"}
                rel material:binding:physics = <../{shape.name}_friction>
            {_placed(shape.frame, shape.sizes if is_box else np.ones(3))}
            }}"""


def _joint(link: Link, parent: str, body: str) -> str:
    axis = "XYZ"[int(np.argmax(np.abs(link.axis)))]
    turn = _HALF_TURN if min(link.axis) < 0.0 else _UNTURNED
    return f"""
        def {_TYPES[link.kind]} "{link.joint}"
        {{
            uniform token physics:axis = "{axis}"{parent}
            rel physics:body1 = {body}
            point3f physics:localPos0 = {_tuple(link.place)}
            quatf physics:localRot0 = {turn}
            point3f physics:localPos1 = (0, 0, 0)
            quatf physics:localRot1 = {turn}
        }}"""


def _placed(frame: Frame, scale: Iterable[float]) -> str:
    names = ", ".join(f'"xformOp:{name}"' for name in ("translate", "orient", "scale"))
    return f"""double3 xformOp:translate = {_tuple(frame.place)}
            quatd xformOp:orient = {_tuple(frame.turn)}
            double3 xformOp:scale = {_tuple(scale)}
            uniform token[] xformOpOrder = [{names}]"""


def _tuple(values: Iterable[float]) -> str:
    return str(tuple(float(value) for value in values))
