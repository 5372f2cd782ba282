"""Meshes of the links of a hand, which only the dashboard draws; a scenario does not name them."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.chain import ChainJoint
from slipgrasp.core.scenario.field_errors import single_error
from slipgrasp.core.scenario.scenario import Scenario
from slipgrasp.core.scenario.spatial import SpatialScenario

MOST_TRIANGLES = 200_000
_MOST_BYTES = 50_000_000
_SUFFIX = ".meshes.npz"
_OF_ZIP = zipfile.BadZipFile, zlib.error
_CHAINS, _BASE = "chains", "base"
Chain = tuple[Sequence[ChainJoint], Sequence[float]]
"""Joints and tip of a finger."""


class Mesh(NamedTuple):
    """Triangles between vertices ``(v, 3)`` [m], with indices ``(f, 3)``."""

    vertices: NDArray[np.floating]
    faces: NDArray[np.uint32]


@dataclass(frozen=True, slots=True, eq=False)
class HandMeshes:
    """The meshes of a hand.

    Attributes:
        chains: The numbers of its fingers that determine their geometry, as JSON.
        base: Mesh fixed to its base, in the frame of the base.
        links: For each finger, the mesh that moves with each link, in the frame of the link.
    """

    chains: str
    base: Mesh
    links: tuple[tuple[Mesh, ...], ...]

    @classmethod
    def of(cls, chains: Sequence[Chain], base: Mesh, links: Sequence[Sequence[Mesh]]) -> HandMeshes:
        """The meshes of some fingers."""
        return cls(_numbers(chains), base, tuple(map(tuple, links)))

    @property
    def num_triangles(self) -> int:
        """Number of triangles of all meshes."""
        return sum(len(mesh.faces) for _, mesh in self._named())

    def fit(self, scenario: Scenario) -> bool:
        """Whether the fingers of a scenario are those of the hand, apart from masses and bases."""
        if not isinstance(scenario, SpatialScenario):
            return False
        are_chains = all(finger.kind == "chain" for finger in scenario.fingers)
        return are_chains and self.chains == _numbers([(f.joints, f.tip) for f in scenario.fingers])

    def save(self, path: Path) -> None:
        """Writes them to a file.

        Raises:
            OSError: If the file cannot be written.
        """
        arrays: dict[str, Any] = {_CHAINS: np.array(self.chains)}
        for name, mesh in self._named():
            arrays[f"{name}.vertices"] = mesh.vertices.astype(np.float32)
            arrays[f"{name}.faces"] = mesh.faces
        np.savez_compressed(path, **arrays)

    def _named(self) -> list[tuple[str, Mesh]]:
        links = [
            (f"{i}.{k}", mesh) for i, each in enumerate(self.links) for k, mesh in enumerate(each)
        ]
        return [(_BASE, self.base), *links]


def meshes_file(hand: Path) -> Path:
    """Returns the file of the meshes of a hand file or a scenario file."""
    return hand.with_suffix(_SUFFIX)


def load_meshes(path: Path) -> HandMeshes:
    """Reads the meshes of a hand.

    Raises:
        ScenarioError: If the file is damaged or too large.
    """
    try:
        _check_size(path)
        with np.load(path, allow_pickle=False) as arrays:
            chains = str(arrays[_CHAINS])
            links = [
                tuple(_mesh(arrays, f"{i}.{k}") for k in range(len(joints)))
                for i, (joints, _) in enumerate(json.loads(chains))
            ]
            return HandMeshes(chains, _mesh(arrays, _BASE), tuple(links))
    except (OSError, ValueError, LookupError, TypeError, EOFError, *_OF_ZIP) as error:
        words = f"'{path}' is damaged; 'slipgrasp hands import' writes it again: {error}"
        raise _error(path, words) from error


def _check_size(path: Path) -> None:
    """Raises an error if the arrays of a file are too large in memory."""
    with zipfile.ZipFile(path) as archive:
        if sum(each.file_size for each in archive.infolist()) > _MOST_BYTES:
            raise ValueError(f"it is larger than {_MOST_BYTES // 1_000_000} MB")


def _mesh(arrays: Any, name: str) -> Mesh:
    vertices, faces = arrays[f"{name}.vertices"], arrays[f"{name}.faces"]
    are_points = vertices.dtype == np.float32 and vertices.ndim == 2 and vertices.shape[1] == 3
    are_indices = faces.dtype == np.uint32 and faces.ndim == 2 and faces.shape[1] == 3
    if not (are_points and are_indices and (faces < len(vertices)).all()):
        raise ValueError(f"'{name}' is not a mesh")
    return Mesh(vertices, faces)


def _numbers(chains: Sequence[Chain]) -> str:
    fields = attrgetter("kind", "place", "attitude", "axis", "follows", "ratio", "offset")
    return json.dumps([([fields(joint) for joint in joints], tip) for joints, tip in chains])


def _error(path: Path, message: str) -> ScenarioError:
    return single_error("hand", path.name, "meshes of a hand", message)
