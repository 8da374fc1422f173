"""Names of the files that replace meshes, and the scales by which a body uses each mesh. Pure."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from rbxcompose.body.model import Body
from rbxcompose.body.simplification import Scale

UNSCALED: Scale = (1.0, 1.0, 1.0)
_WAYS: Sequence[Callable[[Path], str]] = (
    lambda path: path.stem,
    lambda path: f"{path.parent.name}_{path.stem}",
    lambda path: f"{path.parent.name}_{path.stem}_{path.suffix[1:]}",
)


def file_names(paths: Sequence[Path]) -> dict[Path, str]:
    """Return a name that ends in `.stl` for each file, all of them different, and the shortest that are."""
    for way in _WAYS:
        names = [way(path) for path in paths]
        if len({name.lower() for name in names}) == len(paths):
            break
    else:
        names = [f"{number}_{path.stem}" for number, path in enumerate(paths, 1)]
    return {path: f"{name}.stl" for path, name in zip(paths, names, strict=True)}


def scales_of(body: Body, names: Collection[str]) -> dict[str, set[Scale]]:
    """Return the scales of each mesh that a body uses, by its name in the URDF."""
    found: dict[str, set[Scale]] = {name: set() for name in names}
    for link in body.links.values():
        for shape in (*link.visuals, *link.collisions):
            if shape.geometry.file in found:
                found[shape.geometry.file].add(shape.geometry.size)
    return {name: scales or {UNSCALED} for name, scales in found.items()}
