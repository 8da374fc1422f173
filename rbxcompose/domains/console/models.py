"""The body of the robot for browsers: its URDF, with addresses of meshes that the gateway serves."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

from rbxcompose.base.dataclass import dataclass

MESHES = "meshes"  # below the address of the URDF
_FILE = re.compile(r'(<mesh\b[^>]*\bfilename\s*=\s*)(["\'])(.*?)\2', re.DOTALL)
_TYPES = {".stl": "model/stl", ".dae": "model/vnd.collada+xml", ".obj": "model/obj"}


@dataclass(frozen=True, slots=True)
class ServedModel:
    """A URDF whose meshes are at `meshes/NUMBER/NAME`, and the file of each number."""

    urdf: str
    files: tuple[Path, ...]

    def file(self, number: int) -> tuple[Path, str] | None:
        """Return a file with its media type; None if there is no such mesh, or no file of a known kind."""
        if not 0 <= number < len(self.files):
            return None
        path = self.files[number]
        kind = _TYPES.get(path.suffix.lower())
        return (path, kind) if kind and path.is_file() else None


def served(urdf: str) -> ServedModel:
    """Return what is served of a URDF: only files that it names have an address."""
    files: dict[str, Path] = {}

    def address(found: re.Match[str]) -> str:
        name = found[3]
        path = files.setdefault(name, _path(name))
        return f"{found[1]}{found[2]}{MESHES}/{list(files).index(name)}/{quote(path.name)}{found[2]}"

    rewritten = _FILE.sub(address, urdf)
    return ServedModel(rewritten, tuple(files.values()))


def _path(name: str) -> Path:
    return Path(unquote(urlsplit(name).path) if name.startswith("file://") else name)
