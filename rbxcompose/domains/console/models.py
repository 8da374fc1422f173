"""The robot's body for viewers: its URDF with addresses of meshes that the console serves, and those meshes."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import quote

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import open_regular
from rbxcompose.base.findings import Finding
from rbxcompose.domains.body.description import to_xml, with_meshes
from rbxcompose.domains.body.files import mesh_names
from rbxcompose.domains.body.xml_reader import read_urdf

MESHES = "/console/meshes/"
TYPES = {".stl": "model/stl", ".dae": "model/vnd.collada+xml", ".obj": "model/obj", ".glb": "model/gltf-binary"}
_CANDIDATES = "candidates/"
_MOST_CANDIDATES = 8
_OTHER = "application/octet-stream"


@dataclass(frozen=True, slots=True)
class ServedFile:
    """What a browser gets, with the tag by which it knows that it has the same already."""

    content: bytes
    kind: str
    tag: str


class ServedModel:
    """The URDF of a robot, and the meshes that it names; nothing else can be asked for."""

    def __init__(self, urdf: str, meshes: Mapping[str, str], folder: str = "") -> None:
        """Take the URDF, empty if the robot has no body, and the files that exist, by their names in the URDF.

        Their addresses are in a `folder` below `MESHES`, which ends with a slash.
        """
        self.urdf: ServedFile | None = None
        self._files: dict[str, Path] = {}
        root = read_urdf(urdf, "the URDF") if urdf else None
        if root is None or isinstance(root, Finding):
            return
        # What a browser asks for is looked up, and never becomes part of a path; the name is for people.
        addresses = {
            name: f"{folder}{number}/{Path(name).name}" for number, name in enumerate(sorted({*mesh_names(root)}))
        }
        self._files = {address: Path(meshes[name]) for name, address in addresses.items() if name in meshes}
        served = {name: f"{MESHES}{quote(address)}" for name, address in addresses.items()}
        text = to_xml(with_meshes(root, served)).encode()
        self.urdf = ServedFile(text, "application/xml", f'"{hashlib.sha256(text).hexdigest()[:32]}"')

    def mesh(self, address: str) -> ServedFile | None:
        """Return the mesh at an address below `MESHES`; None if the URDF names none there, or its file is gone."""
        if (path := self._files.get(address)) is None:
            return None
        try:
            with open_regular(path, follow=False) as file:
                found = os.fstat(file.fileno())
                tag = f'"{found.st_mtime_ns:x}-{found.st_size:x}"'
                return ServedFile(file.read(), TYPES.get(path.suffix.lower(), _OTHER), tag)
        except OSError:  # removed or replaced since the robot was compiled: the page names the mesh that is missing
            return None


class CandidateModels:
    """Bodies of robots that nobody has saved yet, as viewers get them; the newest few are kept."""

    def __init__(self) -> None:
        self._models: dict[str, ServedModel] = {}

    def add(self, urdf: str, meshes: Mapping[str, str]) -> str:
        """Return the URDF with addresses of its meshes."""
        key = hashlib.sha256(f"{urdf}{sorted(meshes.items())}".encode()).hexdigest()[:32]
        model = self._models.pop(key, None) or ServedModel(urdf, meshes, f"{_CANDIDATES}{key}/")
        self._models[key] = model
        while len(self._models) > _MOST_CANDIDATES:
            del self._models[next(iter(self._models))]
        return model.urdf.content.decode() if model.urdf is not None else ""

    def mesh(self, address: str) -> ServedFile | None:
        """Return the mesh at an address below `MESHES`; None if there is none."""
        key = address.removeprefix(_CANDIDATES).partition("/")[0]
        model = self._models.get(key)
        return model.mesh(address) if model is not None else None
