"""Masses and limits that no robot has are told, and what merely looks odd is not."""

from __future__ import annotations

from rbxcompose.domains.body.lint import lint
from tests.body.kinematics import description_of
from tests.loops import for_all

BOX = '<visual><geometry><box size="1 1 1"/></geometry></visual>'
HEAVY = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def inertial(mass: float, xx: float = 0, yy: float = 0, zz: float = 0, xy: float = 0, at: str = "0 0 0") -> str:
    moments = f'<inertia ixx="{xx}" ixy="{xy}" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>'
    return f'<inertial><origin xyz="{at}"/><mass value="{mass}"/>{moments}</inertial>'


def joint(child: str, kind: str, parent: str = "base", limit: str = "") -> str:
    inside = f'<parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>{limit}'
    return f'<joint name="to_{child}" type="{kind}">{inside}</joint>'


def findings(**links: str) -> list[str]:
    """Return what is told of `arm`, which turns on `base`, and of what is fixed to it."""
    lines = [f'<link name="{name}">{inside}</link>' for name, inside in {"base": HEAVY, **links}.items()]
    lines += [
        joint(name, "continuous" if name == "arm" else "fixed", "base" if name == "arm" else "arm") for name in links
    ]
    return told("".join(lines))


def told(inside: str) -> list[str]:
    return [f"{one.code} {one.message}" for one in lint(description_of(f'<robot name="r">{inside}</robot>').body, ())]


RIGHT = {
    "a mass": {"arm": BOX + HEAVY},
    "a frame": {"arm": ""},
    "a frame with zeros": {"arm": inertial(0.0)},
    "a shape that is held by what has mass": {"arm": HEAVY, "hand": BOX},
    "a shape that holds what has mass": {"arm": BOX, "hand": HEAVY},
    "a point that is held by what has a size": {"arm": HEAVY, "hand": inertial(1.0)},
    "points that are no line": {
        "arm": inertial(1.0),
        "hand": inertial(1.0, at="1 0 0"),
        "tool": inertial(1.0, at="0 1 0"),
    },
    "a plate": {"arm": inertial(1.0, 1, 2, 3)},
    "noise beside what holds it": {"arm": HEAVY, "hand": inertial(1.0, 1e-18, -1e-18, 1e-20)},
}


@for_all("name", RIGHT)
def test_what_a_rigid_body_can_have_is_not_told(name: str) -> None:
    assert findings(**RIGHT[name]) == []


WRONG = {
    "no mass": ({"arm": BOX}, "RBX2009 link 'arm' moves and has no mass"),
    "a mass of zero": ({"arm": BOX + inertial(0.0)}, "RBX2009 link 'arm' moves and has no mass"),
    "a shape further on": ({"arm": "", "hand": BOX}, "RBX2009 link 'arm' moves and has no mass"),
    "a negative mass": ({"arm": inertial(-1.0, 1, 1, 1)}, "RBX2010 link 'arm' has the mass -1 kg"),
    "inertia alone": ({"arm": inertial(0.0, 1, 1, 1)}, "RBX2010 link 'arm' has a moment of inertia and no mass"),
    "a negative moment": ({"arm": inertial(1.0, 1, 1, 1, xy=2)}, "RBX2010 link 'arm' has a negative moment of inertia"),
    "one large moment": (
        {"arm": inertial(1.0, 1, 2, 3.1)},
        "RBX2010 link 'arm' has a moment of inertia larger than the two others together: izz = 3.1, ixx + iyy = 3",
    ),
    "a point": ({"arm": inertial(1.0)}, "RBX2010 link 'arm' has a mass and no moment of inertia about an axis"),
    "points in a line": (
        {"arm": inertial(1.0), "hand": inertial(1.0, at="1 2 0")},
        "RBX2010 link 'arm' and what is fixed to it have a mass and no moment of inertia about an axis",
    ),
}


@for_all("name", WRONG)
def test_what_no_rigid_body_has_is_told_once(name: str) -> None:
    links, expected = WRONG[name]
    assert findings(**links) == [expected]


LIMITS = {
    "usual ones": ("revolute", LIMIT, ""),
    "a passive joint": ("continuous", '<limit effort="0" velocity="1"/>', ""),
    "no range of a wheel": ("continuous", '<limit effort="1" velocity="1"/>', ""),
    "no range": ("revolute", '<limit effort="1" velocity="1"/>', "the range of joint 'to_arm' is zero"),
    "one end": ("revolute", '<limit upper="1" effort="1" velocity="1"/>', ""),
    "no speed": ("continuous", '<limit effort="1" velocity="0"/>', "the velocity of joint 'to_arm' is zero"),
    "nothing": (
        "prismatic",
        '<limit effort="0" velocity="0"/>',
        "the range and the velocity and the effort of joint 'to_arm' are zero",
    ),
    "no speed of a follower": ("revolute", LIMIT.replace('y="1"', 'y="0"') + '<mimic joint="to_leader"/>', ""),
    "none of the leader's": (
        "revolute",
        LIMIT + '<mimic joint="to_slide" offset="9"/>',
        "the limits of joint 'to_arm' leave nothing of those of 'to_slide'",
    ),
}


@for_all("name", LIMITS)
def test_limits_that_keep_a_joint_from_moving_are_told(name: str) -> None:
    kind, limit, expected = LIMITS[name]
    links = "".join(f'<link name="{link}">{HEAVY}</link>' for link in ("base", "arm", "leader", "slide"))
    leaders = joint("leader", "continuous") + joint("slide", "prismatic", limit=LIMIT)
    found = told(links + joint("arm", kind, limit=limit) + leaders)
    assert found == ([f"RBX2011 {expected}"] if expected else [])


@for_all(
    "ends, is_said",
    [
        ('lower="-2" upper="2"', True),
        ('upper="1.5"', True),
        ('lower="-3.14159" upper="3.14159"', False),
        ('lower="-1e16" upper="1e16"', False),
        ('lower="0" upper="0"', False),
    ],
)
def test_limits_of_a_joint_that_turns_on_and_on_do_not_count(ends: str, is_said: bool) -> None:
    links = "".join(f'<link name="{link}">{HEAVY}</link>' for link in ("base", "arm"))
    found = told(links + joint("arm", "continuous", limit=f'<limit {ends} effort="1" velocity="1"/>'))
    words = "RBX2025 'lower' and 'upper' of joint 'to_arm' do not count: it is 'continuous', and turns on and on"
    assert found == ([words] if is_said else [])


@for_all("kind", ["planar", "floating"])
def test_a_joint_of_more_than_one_position_is_taken_to_be_at_rest(kind: str) -> None:
    links = f'<link name="base"/><link name="arm"/>{joint("arm", kind)}'
    assert told(links) == [f"RBX2024 joint 'to_arm' is {kind}, and is taken to be at rest"]


def test_the_axis_of_a_joint_that_needs_none_may_be_zero() -> None:
    fixed = joint("arm", "fixed").replace("0 0 1", "0 0 0")
    assert told(f'<link name="base"/><link name="arm"/>{fixed}') == []
