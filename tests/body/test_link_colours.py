"""In pictures, links without materials differ in colour from their neighbours; those with materials keep them."""

from __future__ import annotations

import numpy as np
import pytest

from rbxcompose.domains.body.meshes import GREY, joined
from rbxcompose.domains.body.picture import bounds_of, png_of, rendered, solids_of_links
from tests.body.kinematics import description_of

URDF = """<robot name="arm">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="frame"/>
  <link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
  <link name="upper"><visual><geometry><sphere radius="0.2"/></geometry></visual></link>
  <link name="hand"><visual><geometry><sphere radius="0.2"/></geometry><material name="red"/></visual></link>
  <joint name="a" type="fixed"><parent link="frame"/><child link="base"/></joint>
  <joint name="b" type="fixed"><parent link="base"/><child link="upper"/><origin xyz="0 0 1"/></joint>
  <joint name="c" type="fixed"><parent link="upper"/><child link="hand"/><origin xyz="0 0 1"/></joint>
</robot>
"""


def test_links_without_materials_can_be_told_apart() -> None:
    body = description_of(URDF).body
    found = {
        name: np.unique(np.concatenate([solid.colours for solid in solids]), axis=0).tolist()
        for name, solids in solids_of_links(body, {}, {}).items()
    }
    assert found["hand"] == [[1, 0, 0]]
    assert found["base"] != found["upper"]
    assert [list(GREY)] not in found.values()


def test_the_body_fills_its_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.domains.body.picture.SIZE", 200)
    solids = solids_of_links(description_of(URDF).body, {}, {})
    whole = joined([solid for each in solids.values() for solid in each])
    pixels = rendered(whole, bounds_of(whole))
    rows = np.flatnonzero((pixels < 1).any(axis=(1, 2)))
    assert rows[-1] - rows[0] > 0.8 * len(pixels)
    assert rows[0] > 0
    assert png_of(pixels).startswith(b"\x89PNG")
