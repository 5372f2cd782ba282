"""The links and joints of a hand from its MJCF file, as MuJoCo reads it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipgrasp.core.scenario.chain import rotation_of
from slipgrasp.core.scenario.hand_files.description import (
    Body,
    Floats,
    Follows,
    Joint,
    Pose,
    refusal,
)
from slipgrasp.core.scenario.hand_files.visuals import ROUND, Visuals

if TYPE_CHECKING:
    from trimesh import Trimesh

_KINDS = ("free", "ball", "prismatic", "revolute")  # by mjtJoint
_EQUAL_JOINTS, _ON_JOINT = 2, 0  # mjtEq, mjtTrn
_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = range(2, 8)  # mjtGeom
_SHAPES = (_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH)
_HIDDEN = 3  # first group of geoms that MuJoCo's viewer hides
_NOTHING = Body(0.0, np.zeros(3), np.zeros((3, 3)))


def read_mjcf(path: Path, tips: Collection[str]) -> tuple[dict[str, Body], list[Joint]]:
    """Links by name, and the joints between them.

    Joint positions are relative to the reference of MuJoCo (``ref``). Properties of joints that
    chains of a scenario do not have are omitted: damping, friction, springs and motor inertia.

    Args:
        path: The file; included files are also read.
        tips: Names of sites that become links without mass.

    Raises:
        ScenarioError: If MuJoCo is not installed or does not accept the file.
    """
    model = _model_of(path)
    bodies, joints = {"world": _body_of(model, 0)}, list[Joint]()
    for number in range(1, model.nbody):
        joints += _joints_to(model, number)
        bodies[_body_name(model, number)] = _body_of(model, number)
    for number in range(model.nsite):
        name = model.site(number).name
        if name in tips and name not in bodies:
            pose = _pose(model.site_pos[number], model.site_quat[number])
            parent = _body_name(model, model.site_bodyid[number])
            joints.append(Joint(f"to {name}", "fixed", parent, name, pose))
    return {joint.child: _NOTHING for joint in joints} | bodies, joints


def read_mjcf_visuals(path: Path) -> Visuals:
    """Returns the reader of the shapes of an MJCF file that MuJoCo shows: groups 0 to 2.

    Args:
        path: The file, which `read_mjcf` accepts.
    """
    model = _model_of(path)
    bodies = {_body_name(model, number): number for number in range(model.nbody)}

    def read(link: str) -> Iterator[tuple[Pose, Trimesh]]:
        for geom in np.flatnonzero(model.geom_bodyid == bodies.get(link, -1)).tolist():
            is_shown = model.geom_group[geom] < _HIDDEN and model.geom_type[geom] in _SHAPES
            if is_shown:
                pose = _pose(model.geom_pos[geom], model.geom_quat[geom])
                yield pose, _shape(model, geom)

    return read


def _shape(model: Any, geom: int) -> Trimesh:
    """The triangles of a geom, in its frame."""
    from trimesh import Trimesh, creation

    kind, (x, y, z) = model.geom_type[geom], model.geom_size[geom].tolist()
    if kind == _MESH:
        mesh = model.mesh(model.geom_dataid[geom])
        first, start = mesh.vertadr[0], mesh.faceadr[0]
        vertices = model.mesh_vert[first : first + mesh.vertnum[0]]
        return Trimesh(vertices, model.mesh_face[start : start + mesh.facenum[0]])
    if kind == _BOX:
        return creation.box((2.0 * x, 2.0 * y, 2.0 * z))
    if kind == _CAPSULE:
        return creation.capsule(2.0 * y, x, count=ROUND)
    if kind == _CYLINDER:
        return creation.cylinder(x, 2.0 * y)
    axes = (x, x, x) if kind == _SPHERE else (x, y, z)
    return creation.uv_sphere(1.0, count=ROUND).apply_scale(axes)


def _model_of(path: Path) -> Any:
    """The model that MuJoCo makes of a file."""
    try:
        mujoco: Any = import_module("mujoco")
    except ImportError:
        words = "MJCF files are read by the package mujoco: pip install 'slipgrasp[mjcf]'"
        raise refusal(path.name, "URDF", words) from None
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        words = f"MuJoCo does not accept '{path.name}': {' '.join(str(error).split())}"
        raise refusal(path.name, "MJCF", words) from None


def _joints_to(model: Any, number: int) -> Iterator[Joint]:
    """Joints between a body and its parent, one after the other, with links between them."""
    parent, child = (_body_name(model, n) for n in (model.body_parentid[number], number))
    pose, anchor = _pose(model.body_pos[number], model.body_quat[number]), np.zeros(3)
    first, count = model.body_jntadr[number], model.body_jntnum[number]
    for joint in range(first, first + count):
        name = _joint_name(model, joint)
        pose = pose.after(_at(model.jnt_pos[joint] - anchor))
        anchor = model.jnt_pos[joint]
        is_body = joint == first + count - 1 and not anchor.any()
        link = child if is_body else f"{name} of {child}"
        low, high = _range(model, joint)
        yield Joint(
            name,
            _KINDS[model.jnt_type[joint]],
            parent,
            link,
            pose,
            model.jnt_axis[joint].copy(),
            low,
            high,
            _largest_torque(model, joint),
            _leader(model, joint),
        )
        parent, pose = link, _at(np.zeros(3))
    if parent != child:
        yield Joint(f"to {child}", "fixed", parent, child, pose.after(_at(-anchor)))


def _range(model: Any, joint: int) -> tuple[float | None, float | None]:
    """Smallest and largest position of a joint relative to its reference [rad, m]."""
    if not model.jnt_limited[joint]:
        return None, None
    low, high = (model.jnt_range[joint] - model.qpos0[model.jnt_qposadr[joint]]).tolist()
    return low, high


def _largest_torque(model: Any, joint: int) -> float | None:
    """Smallest torque or force limit of a joint [N m, N]; None if there is none."""
    found = list[float]()
    if model.jnt_actfrclimited[joint]:
        found.append(np.abs(model.jnt_actfrcrange[joint]).max())
    for k in range(model.nu):
        on_joint = model.actuator_trntype[k] == _ON_JOINT and model.actuator_trnid[k, 0] == joint
        if on_joint and model.actuator_forcelimited[k]:
            largest = np.abs(model.actuator_forcerange[k]).max()
            found.append(abs(model.actuator_gear[k, 0]) * largest)
    return float(min(found)) if found else None


def _leader(model: Any, joint: int) -> Follows | None:
    """The joint that a joint follows by an equality constraint of the file; None if none."""
    for k in range(model.neq):
        if model.eq_type[k] != _EQUAL_JOINTS or model.eq_obj1id[k] != joint:
            continue
        offset, ratio, *rest = model.eq_data[k, :5].tolist()
        if any(rest) or model.eq_obj2id[k] < 0:
            name = _joint_name(model, joint)
            words = f"joint '{name}' follows by a polynomial, which joints of a chain cannot"
            raise refusal(name, "a ratio and an offset", words)
        return Follows(_joint_name(model, model.eq_obj2id[k]), ratio, offset)
    return None


def _body_of(model: Any, number: int) -> Body:
    place = _pose(model.body_ipos[number], model.body_iquat[number])
    inertia = np.diag(model.body_inertia[number])
    return Body(float(model.body_mass[number]), np.zeros(3), inertia).seen_from(place)


def _body_name(model: Any, number: int) -> str:
    return model.body(number).name or f"body_{number}"


def _joint_name(model: Any, number: int) -> str:
    return model.joint(number).name or f"joint_{number}"


def _pose(place: Floats, quaternion: Floats) -> Pose:
    return Pose(rotation_of(quaternion.tolist()), place.copy())


def _at(place: Floats) -> Pose:
    return Pose(np.eye(3), place)
