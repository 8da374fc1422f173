"""A body as a graph: every link and joint is there, whatever its name."""

from __future__ import annotations

from itertools import pairwise

import pygraphviz
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Span
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.body.commands.body import axis_words, body_dot, draw_graph
from rbxcompose.domains.body.model import Body, BodyJoint, BodyLink
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from rbxcompose.testing.golden import Golden

URDF = """<robot name="r"><link name="base"/><link name="arm"/><link name="tip"/><link name="rope"/>
<joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/><axis xyz="0 0 -1"/>
<limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<joint name="follow" type="continuous"><parent link="arm"/><child link="tip"/><axis xyz="1 1 0"/>
<mimic joint="lift"/></joint>
<joint name="tie" type="floating"><parent link="base"/><child link="rope"/></joint></robot>"""
PLACE = Span("r.urdf", 1, 1, 1, 1)
NAMES = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), min_size=1, max_size=8)


def chain(names: list[str]) -> Body:
    """Return a body whose links hang on each other in this order."""
    links = {name: BodyLink(name, PLACE) for name in names}
    joints = {
        above: BodyJoint(above, "fixed", above, below, Transform3(), (1.0, 0.0, 0.0), PLACE)
        for above, below in pairwise(names)
    }
    return Body("chain", links, joints)


def test_moving_joints_differ_from_fixed_ones(golden: Golden) -> None:
    root = read_urdf(URDF, "r.urdf")
    assert isinstance(root, XmlElement)
    golden.check("body.dot", body_dot(read_body(root)[0]))


@given(st.lists(NAMES, min_size=1, max_size=4, unique=True))
def test_every_name_is_a_text_that_graphviz_reads(names: list[str]) -> None:
    graph = pygraphviz.AGraph(string=body_dot(chain(names)))
    assert (len(graph.nodes()), len(graph.edges())) == (len(names), len(names) - 1)


@pytest.mark.parametrize("names", [['<b>&amp;\\N"', "a:b"], ["{|}", "\\"]])
def test_names_are_drawn_as_they_are(names: list[str]) -> None:
    drawn = draw_graph(chain(names), "svg").decode()
    assert drawn.count("<g ") >= 3
    for shown in ("&lt;b&gt;&amp;amp;\\N&quot;", "a:b") if "a:b" in names else ("{|}", ">\\</text>"):
        assert shown in drawn


@pytest.mark.parametrize(
    ("axis", "words"), [((0.0, 0.0, 1.0), "z"), ((0.0, -1.0, 0.0), "-y"), ((0.7071, 0.7071, 0.0), "0.707 0.707 0")]
)
def test_an_axis_is_told_in_short(axis: tuple[float, float, float], words: str) -> None:
    assert axis_words(axis) == words
