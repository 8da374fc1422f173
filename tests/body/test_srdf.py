"""SRDF: what is written reads back the same."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.body.link_pairs import REASONS, pair_of
from rbxcompose.domains.body.srdf import (
    EndEffector,
    OuterJoint,
    SemanticGroup,
    Semantics,
    is_srdf,
    read_semantics,
    to_srdf,
)
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from tests.motion.toy_arm import urdf

NAMES = st.text("abcXYZ_09é<&\"'", min_size=1, max_size=6)
SEVERAL = st.lists(NAMES, max_size=3).map(tuple)
NUMBERS = st.floats(-10, 10)
GROUPS = st.builds(
    SemanticGroup, NAMES, st.lists(st.tuples(NAMES, NAMES), max_size=2).map(tuple), SEVERAL, SEVERAL, SEVERAL
)
POSES = st.dictionaries(
    NAMES, st.dictionaries(NAMES, st.dictionaries(NAMES, NUMBERS, max_size=3), min_size=1, max_size=2)
)
SAID = st.builds(
    Semantics,
    NAMES,
    st.lists(GROUPS, max_size=3).map(lambda found: {item.name: item for item in found}),
    POSES,
    st.lists(st.builds(EndEffector, NAMES, NAMES, NAMES, NAMES | st.just("")), max_size=2).map(tuple),
    SEVERAL,
    st.dictionaries(st.builds(pair_of, NAMES, NAMES), st.sampled_from(REASONS), max_size=4),
    st.lists(st.builds(OuterJoint, NAMES, NAMES, NAMES, NAMES), max_size=2).map(tuple),
)


def read(text: str) -> XmlElement:
    root = read_urdf(text, "robot.srdf")
    assert isinstance(root, XmlElement), root
    return root


@given(SAID)
def test_what_is_written_reads_back_the_same(said: Semantics) -> None:
    assert read_semantics(read(to_srdf(said))) == said


def test_what_moveit_alone_understands_is_kept_with_its_place() -> None:
    text = """<robot name="a">
  <group name="g"><joint name="j"/></group>
  <link_sphere_approximation link="base"/>
  <group_state name="s" group="g"><joint name="j" value="1 2"/></group_state>
  <disable_collisions link1="b" link2="a" reason="CollisionIgnoredBySomebody"/>
</robot>"""
    said = read_semantics(read(text))
    assert [(words, span.line) for words, span in said.others] == [
        ("'1 2' is not a single position of a joint", 4),
        ("the element 'link_sphere_approximation'", 3),
    ]
    assert said.pairs == {("a", "b"): "user"}
    assert is_srdf(read(text))
    assert not is_srdf(read(urdf()))
