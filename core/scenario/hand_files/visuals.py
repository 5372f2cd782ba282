"""Visual geometry of the links of a hand, from the mesh files and simple shapes of its file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.field_errors import shortened
from slipgrasp.core.scenario.hand_files.description import (
    Description,
    ImportedFinger,
    Pose,
    refusal,
)
from slipgrasp.core.scenario.hand_files.meshes import MOST_TRIANGLES, HandMeshes, Mesh
from slipgrasp.core.scenario.hand_files.urdf import pose_in, vector

if TYPE_CHECKING:
    from trimesh import Trimesh

_MOST_BYTES = 50_000_000
_SHARP = 0.6  # [rad], between two triangles
_READ = "STL, OBJ, PLY or GLB"

ROUND = (16, 32)
"""Number of parallels and meridians of a ball."""
Visuals = Callable[[str], Iterable[tuple[Pose, "Trimesh"]]]
"""Reads the visible shapes of a link [m], each with its pose in the frame of the link."""


def meshes_of(
    hand: Description, fingers: Sequence[ImportedFinger], visuals: Visuals
) -> HandMeshes | None:
    """Returns the meshes of the links of some fingers, and of the base; None if nothing is visible.

    Args:
        hand: The hand.
        fingers: Its fingers, in the order of those of the scenario.
        visuals: Reads the visible shapes; only those of base and fingers are read.

    Raises:
        ScenarioError: If a shape cannot be read, or there are too many triangles.
    """
    try:
        base = _joined(visuals, hand.base())
        links = [[_joined(visuals, part) for part in finger.parts] for finger in fingers]
    except ScenarioError:
        raise
    except ValueError as error:
        words = f"a visible shape of the file cannot be read: {error}"
        raise refusal("the file", "URDF", words) from None
    count = sum(len(mesh.faces) for mesh in (base, *chain.from_iterable(links)))
    _check_count(count, "the meshes have")
    return HandMeshes.of([(f.joints, f.tip) for f in fingers], base, links) if count else None


def _joined(visuals: Visuals, parts: Mapping[str, Pose]) -> Mesh:
    """The triangles of links that move together, in the frame of the first one."""
    from trimesh.graph import smooth_shade

    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.uint32)], 0
    for link, place in parts.items():
        for pose, shape in visuals(link):
            # Triangles at sharp edges get separate corners, so that edges are visible.
            shaded, (turn, origin) = smooth_shade(shape, angle=_SHARP), place.after(pose)
            vertices.append(shaded.vertices @ turn.T + origin)
            faces.append((shaded.faces + count).astype(np.uint32))
            count += len(shaded.vertices)
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def read_urdf_visuals(text: str, folder: Path, packages: Iterable[Path] = ()) -> Visuals:
    """Returns the reader of the visible shapes of a URDF file.

    Args:
        text: The file, which `read_urdf` accepts.
        folder: Its folder.
        packages: Folders of the packages in ``package://`` names, in addition to all folders that
            contain the file.
    """
    root, folder = ElementTree.fromstring(text), folder.resolve()
    links = {link.get("name", ""): link.findall("visual") for link in root.findall("link")}
    packages = (*packages, folder, *folder.parents)

    def read(link: str) -> Iterator[tuple[Pose, Trimesh]]:
        for visual in links.get(link, ()):
            for shape in visual.findall("geometry/*"):
                yield pose_in(visual), _urdf_shape(shape, folder, packages)

    return read


def _urdf_shape(shape: ElementTree.Element, folder: Path, packages: Sequence[Path]) -> Trimesh:
    """The triangles of a shape in a URDF file."""
    from trimesh import creation

    def given(name: str, kind: Callable[[str], Any] = float) -> Any:
        return kind(shape.get(name, ""))

    if shape.tag == "mesh":
        mesh = load_mesh(_found(given("filename", str), folder, packages))
        return mesh.apply_transform(np.diag([*vector(shape.get("scale", "1 1 1")), 1.0]))
    if shape.tag == "box":
        return creation.box(given("size", vector))
    if shape.tag == "sphere":
        return creation.uv_sphere(given("radius"), count=ROUND)
    if shape.tag == "cylinder":
        return creation.cylinder(given("radius"), given("length"))
    if shape.tag == "capsule":
        return creation.capsule(given("length"), given("radius"), count=ROUND)
    raise ValueError(f"'{shortened(shape.tag)}' is not a shape of URDF")


def _found(name: str, folder: Path, packages: Sequence[Path]) -> Path:
    """The mesh file of a name in a URDF file.

    Raises:
        ScenarioError: If it does not exist.
    """
    scheme, _, rest = name.rpartition("://")
    tried = [each / rest for each in packages] if scheme == "package" else [folder / rest]
    found = next((path for path in tried if path.is_file()), None)
    if found is None:
        words = f"the mesh file '{name}' does not exist"
        if scheme == "package":
            words = (
                f"the mesh file '{name}' is in no folder around the file; name the folder that "
                f"contains '{rest.partition('/')[0]}' with --packages"
            )
        raise refusal(name, "a mesh file", words)
    return found


def load_mesh(path: Path) -> Trimesh:
    """Reads the triangles of a mesh file.

    Raises:
        ScenarioError: If the file is too large or cannot be read.
    """
    import trimesh

    if path.stat().st_size > _MOST_BYTES:
        words = f"the mesh file '{path}' is larger than {_MOST_BYTES // 1_000_000} MB; reduce it"
        raise refusal(path.name, f"{_MOST_BYTES} bytes", words)
    try:
        mesh = trimesh.load(path, force="mesh", skip_materials=True)
    except Exception as error:
        # Readers of damaged files raise anything, and that of DAE needs another package.
        words = f"the mesh file '{path}' cannot be read; convert it to {_READ}: {error}"
        raise refusal(path.name, _READ, words) from error
    if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces) > 0:
        _check_count(len(mesh.faces), f"the mesh file '{path}' has")
        if np.isfinite(mesh.vertices).all():
            return mesh
    words = f"the mesh file '{path}' contains no finite triangles; convert it to {_READ}"
    raise refusal(path.name, _READ, words)


def _check_count(count: int, subject: str) -> None:
    if count > MOST_TRIANGLES:
        words = f"{subject} {count} triangles, more than {MOST_TRIANGLES}; reduce them"
        raise refusal(count, f"{MOST_TRIANGLES}", words)
