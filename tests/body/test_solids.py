"""Meshes of all formats become triangles in metres, with colours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbxcompose.domains.body.meshes import Solid
from rbxcompose.domains.body.picture import solid_of
from tests.body.kinematics import description_of

DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
  <library_effects><effect id="paint-effect"><profile_COMMON>
    <technique sid="common"><lambert><diffuse>DIFFUSE</diffuse></lambert></technique>
  </profile_COMMON></effect></library_effects>
  <library_materials><material id="paint"><instance_effect url="#paint-effect"/></material></library_materials>
  <library_geometries><geometry id="plate"><mesh>
    <source id="corners">
      <float_array id="numbers" count="9">0 0 0 100 0 0 0 200 0</float_array>
      <technique_common><accessor source="#numbers" count="3" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common>
    </source>
    <vertices id="vertices"><input semantic="POSITION" source="#corners"/></vertices>
    <triangles count="1" material="symbol">
      <input semantic="VERTEX" source="#vertices" offset="0"/><p>0 1 2</p>
    </triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="scene"><node id="node">
    <translate>0 0 300</translate>
    <instance_geometry url="#plate"><bind_material><technique_common>
      <instance_material symbol="symbol" target="#paint"/>
    </technique_common></bind_material></instance_geometry>
  </node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
"""
RED, TEXTURE = "<color>1 0 0 1</color>", '<texture texture="none" texcoord="0"/>'
PLATE = ((0.0, 0.0, 3.0), (1.0, 0.0, 3.0), (0.0, 2.0, 3.0))
OBJ = "v 0 0 3\nv 1 0 3\nv 0 2 3\nf 1 2 3\n"
STL = """solid plate
facet normal 0 0 1
outer loop
vertex 0 0 3
vertex 1 0 3
vertex 0 2 3
endloop
endfacet
endsolid plate
"""
FILES = {
    "plate.dae": DAE.replace("DIFFUSE", RED),
    "broken.dae": DAE.replace("DIFFUSE", TEXTURE).replace("#paint-effect", "#none"),
    "plate.obj": OBJ,
    "plate.stl": STL,
}


def drawn(folder: Path, name: str, inside: str = "", scale: str = "1 1 1") -> Solid:
    file = folder / name
    file.write_text(FILES.get(name, ""), encoding="utf-8")
    mesh = f'<geometry><mesh filename="{name}" scale="{scale}"/></geometry>'
    body = description_of(f'<robot name="r"><link name="base"><visual>{mesh}{inside}</visual></link></robot>').body
    solid = solid_of(body, {}, {name: file})
    assert solid
    return solid


def corners(solid: Solid) -> list[tuple[float, ...]]:
    """Return the corners of all triangles, without those that occur twice."""
    return sorted({tuple(np.round(solid.vertices[one], 9).tolist()) for one in solid.faces.ravel()})


@pytest.mark.parametrize("name", FILES)
def test_a_mesh_of_any_format_is_the_same_in_metres(name: str, tmp_path: Path) -> None:
    assert corners(drawn(tmp_path, name)) == sorted(PLATE)


def test_a_mesh_is_scaled_before_it_is_placed(tmp_path: Path) -> None:
    solid = drawn(tmp_path, "plate.obj", '<origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>', scale="1 2 -1")
    assert corners(solid) == sorted([(0.0, 0.0, -2.0), (0.0, 1.0, -2.0), (-4.0, 0.0, -2.0)])


def test_a_mesh_has_its_own_colour_unless_the_body_gives_it_one(tmp_path: Path) -> None:
    blue = '<material name="blue"><color rgba="0 0 1 1"/></material>'
    assert drawn(tmp_path, "plate.dae").colours.tolist() == [[1.0, 0.0, 0.0]]
    assert drawn(tmp_path, "plate.dae", blue).colours.tolist() == [[0.0, 0.0, 1.0]]


def test_a_mesh_without_triangles_is_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"the mesh 'empty\.obj'"):
        drawn(tmp_path, "empty.obj")
