"""Meshes for coal: the triangles that are in a file, whichever pieces it has."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rbxcompose.domains.arms.motion.collisions import coal_shape
from rbxcompose.domains.arms.motion.figures import SecondChecker
from rbxcompose.domains.arms.motion.sphere_checker import triangles_of
from rbxcompose.domains.body.model import Geometry
from tests.body.kinematics import description_of

Array = NDArray[np.float64]
CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 5), (1, 0, 5), (0, 1, 5))
PIECES = ((0, 1, 2), (3, 4, 5))
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "".join(
    f"usemtl {name}\nf {a + 1} {b + 1} {c + 1}\n" for name, (a, b, c) in zip("ab", PIECES, strict=True)
)
TRIANGLES = "".join(
    f'<triangles material="{name}" count="1"><input semantic="VERTEX" source="#v" offset="0"/>'
    f"<p>{a} {b} {c}</p></triangles>"
    for name, (a, b, c) in zip("ab", PIECES, strict=True)
)
DAE = f"""<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="f" count="18">{" ".join(f"{x} {y} {z}" for x, y, z in CORNERS)}</float_array>
<technique_common><accessor source="#f" count="6" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{TRIANGLES}</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>
<instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""
FILES = {"pieces.obj": (OBJ, 1.0), "pieces.dae": (DAE, 0.01)}
ROBOT = """<robot name="r"><link name="base"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="plates"><collision><geometry><mesh filename="{}" scale="2 1 1"/></geometry></collision></link>
<joint name="j" type="prismatic"><parent link="base"/><child link="plates"/><axis xyz="0 0 1"/>
<limit lower="-10" upper="10" effort="1" velocity="1"/></joint></robot>"""


@pytest.mark.parametrize("name", FILES)
def test_a_mesh_of_several_materials_has_the_triangles_of_its_file(name: str, tmp_path: Path) -> None:
    text, unit = FILES[name]
    (tmp_path / name).write_text(text)
    found = triangles_of(coal_shape(Geometry("mesh", (2.0, 1.0, 1.0), name), {name: tmp_path / name}))
    wanted = np.array(CORNERS)[np.array(PIECES)] * (2.0 * unit, unit, unit)
    assert {_key(triangle) for triangle in found} == {_key(item) for item in wanted}


@pytest.mark.parametrize("name", FILES)
def test_the_second_examination_has_them_too(name: str, tmp_path: Path) -> None:
    text, unit = FILES[name]
    (tmp_path / name).write_text(text)
    checker = SecondChecker(replace(description_of(ROBOT.format(name)), meshes={name: tmp_path / name}), ("j",), ())
    heights = np.array([-6.0, -5.0, -2.5, 0.0, 1.0]) * unit
    away = np.min(np.abs(heights[:, None] + np.array([0.0, 5.0]) * unit), axis=1)
    assert [checker.is_free(np.array([height])) for height in heights] == (away > 0.1).tolist()


def test_a_mesh_without_a_place_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "odd.dae").write_text(DAE.replace("<matrix>1", "<matrix>nan"))
    with pytest.raises(ValueError, match=r"odd\.dae"):
        coal_shape(Geometry("mesh", file="odd.dae"), {"odd.dae": tmp_path / "odd.dae"})


def _key(triangle: Array) -> frozenset[tuple[float, ...]]:
    return frozenset(tuple(np.round(corner, 6).tolist()) for corner in triangle)


def test_a_binary_mesh_without_a_place_is_refused_by_name_too(tmp_path: Path) -> None:
    numbers = np.zeros((2, 12), dtype="<f4")
    numbers[:, 3:] = np.eye(3).flatten()
    numbers[1, 5] = np.nan
    path = tmp_path / "far.stl"
    path.write_bytes(
        bytes(80) + (2).to_bytes(4, "little") + b"".join(number.tobytes() + bytes(2) for number in numbers)
    )
    with pytest.raises(ValueError, match=r"far\.stl' cannot be read: a corner of it is no finite point"):
        coal_shape(Geometry("mesh", file=str(path)), {})
