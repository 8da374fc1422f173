"""Random URDFs: chains and trees of all kinds of joints with a place, and random positions for them."""

from __future__ import annotations

import math

from hypothesis import strategies as st

from rbxcompose.domains.body.model import Body

MOVING = ("revolute", "continuous", "prismatic")
LIMIT = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'


def thousandths(most: float) -> st.SearchStrategy[float]:
    """Draw numbers that are no noise: yourdfpy's graph takes a change below 1e-8 for none."""
    return st.floats(-most, most).map(lambda found: round(found, 3))


def numbers(most: float) -> st.SearchStrategy[str]:
    return st.lists(thousandths(most), min_size=3, max_size=3).map(lambda found: " ".join(map(repr, found)))


@st.composite
def axes(draw: st.DrawFn, kind: str) -> str:
    """Draw an axis of any length; of a prismatic joint it has length 1, since yourdfpy moves by as many lengths."""
    axis = draw(st.tuples(*[st.integers(-3, 3)] * 3).filter(any))
    length = math.hypot(*axis) if kind == "prismatic" else 1
    return " ".join(repr(number / length) for number in axis)


@st.composite
def urdfs(draw: st.DrawFn) -> str:
    """Draw a URDF of up to 10 links; some joints mimic others of their kind."""
    count = draw(st.integers(2, 10))
    kinds: dict[int, str] = {}
    leaders: list[int] = []
    lines = ['<link name="link0"/>']
    for child in range(1, count):
        parent = draw(st.integers(0, child - 1) | st.just(child - 1))
        kinds[child] = kind = draw(st.sampled_from(("fixed", *MOVING)))
        followed = [leader for leader in leaders if kinds[leader] == kind != "continuous"]
        mimic = draw(st.sampled_from([None, *followed]))
        if kind != "fixed" and mimic is None:
            leaders.append(child)
        lines += [f'<link name="link{child}"/>', f'<joint name="joint{child}" type="{kind}">']
        lines.append(f'<parent link="link{parent}"/><child link="link{child}"/>')
        lines.append(f'<origin xyz="{draw(numbers(2.0))}" rpy="{draw(numbers(math.pi))}"/>')
        lines.append(f'<axis xyz="{draw(axes(kind))}"/>')
        if mimic is not None:
            factor, offset = draw(thousandths(2.0)), draw(thousandths(1.0))
            lines.append(f'<mimic joint="joint{mimic}" multiplier="{factor!r}" offset="{offset!r}"/>')
        lines.append(f"{LIMIT}</joint>")
    return '<?xml version="1.0"?>\n<robot name="random">\n' + "\n".join(lines) + "\n</robot>\n"


@st.composite
def positions(draw: st.DrawFn, body: Body) -> dict[str, float]:
    """Draw positions of some joints; the others are at rest."""
    names = [joint.name for joint in body.moving if draw(st.integers(0, 7))]
    return {name: draw(thousandths(7.0)) for name in names}
