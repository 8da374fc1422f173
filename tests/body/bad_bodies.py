"""Bodies made to do harm, by what is wrong with them: the files, and the code that must be told."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

ROBOT = "rbx: 1\nkind: Robot\nname: bad\nbody: {%s: bad.xml}\n"
HEAD = '<robot name="bad" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
PWNED = "pwned"  # the file that attacks try to make
SECRET = "of nobody's business"  # what lies beside the project
LIMIT = '<limit lower="0" upper="1" effort="1" velocity="1"/>'


@dataclass(frozen=True, slots=True)
class BadBody:
    """The description, the code that is told of it, and whether that is at a line of the description."""

    code: str
    text: str
    is_xacro: bool = False
    others: Mapping[str, bytes] | None = None
    prepare: Callable[[Path], object] = lambda folder: None
    is_placed: bool = True

    def write(self, folder: Path) -> Path:
        """Write the robot's project into a folder, and return the robot's file."""
        (folder / "secret.yaml").write_text(f"word: {SECRET}\n")
        project = folder / "project"
        project.mkdir()
        for name, data in (self.others or {}).items():
            (project / name).write_bytes(data)
        (project / "bad.xml").write_text(self.text, encoding="utf-8")
        (project / "robot.yaml").write_text(ROBOT % ("xacro" if self.is_xacro else "urdf"))
        self.prepare(project)
        return project / "robot.yaml"


def urdf(inside: str, code: str = "RBX2003") -> BadBody:
    return BadBody(code, f'<robot name="bad">\n{inside}\n</robot>\n')


def xacro(inside: str, others: Mapping[str, bytes] | None = None, *, is_placed: bool = True) -> BadBody:
    return BadBody("RBX2007", f"{HEAD}{inside}\n</robot>\n", True, others, is_placed=is_placed)


def computed(expression: str, others: Mapping[str, bytes] | None = None, *, is_placed: bool = True) -> BadBody:
    """A xacro file with a name that is computed."""
    return xacro(f'<link name="${{{expression}}}"/>', others, is_placed=is_placed)


def fixed(parent: int, child: int) -> str:
    return f'<joint name="j{child}" type="fixed"><parent link="l{parent}"/><child link="l{child}"/></joint>'


def links(count: int) -> str:
    return "\n".join(f'<link name="l{n}"/>' for n in range(count))


def mesh(name: str, data: bytes, attributes: str = "") -> BadBody:
    text = f'<link name="l"><visual><geometry><mesh filename="{name}" {attributes}/></geometry></visual></link>'
    return BadBody("RBX2015", f'<robot name="bad">\n{text}\n</robot>\n', others={name: data})


def sparse(folder: Path) -> None:
    os.truncate(folder / "big.stl", 500_000_000)


def stl(triangles: int, claimed: int | None = None) -> bytes:
    """A binary STL of some triangles that claims to have more."""
    corners = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    return bytes(80) + struct.pack("<I", triangles if claimed is None else claimed) + corners * triangles


BOMB = "<!DOCTYPE robot [\n<!ENTITY a0 'aaaaaaaaaa'>\n" + "".join(
    f"<!ENTITY a{n} '{f'&a{n - 1};' * 10}'>\n" for n in range(1, 10)
)
TOUCH = f"['touch', '{PWNED}']"
SUBCLASS = "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == 'Popen'][0]"
MATERIAL = '<inertia ixx="1e200" ixy="1e200" ixz="1e308" iyy="1e308" iyz="1e308" izz="1e308"/>'
DOUBLING = "".join(
    f'<xacro:macro name="m{n}"><xacro:m{n + 1}/><xacro:m{n + 1}/></xacro:macro>\n' for n in range(30)
)  # fmt: skip

XML = {
    "a DOCTYPE": BadBody("RBX2001", f"\n<!DOCTYPE robot>\n{HEAD}</robot>"),
    "a DOCTYPE in xacro": BadBody("RBX2007", f"\n<!DOCTYPE robot>\n{HEAD}</robot>", True),
    "an entity bomb": BadBody("RBX2001", f'{BOMB}]><robot name="&a9;"/>'),
    "an entity bomb in xacro": BadBody("RBX2007", f'{BOMB}]><robot name="&a9;"/>', True),
    "an entity of a file": BadBody(
        "RBX2007", '<!DOCTYPE robot [<!ENTITY a SYSTEM "../secret.yaml">]><robot>&a;</robot>', True
    ),
    "100,000 elements inside each other in xacro": xacro("<a>" * 100_000 + "</a>" * 100_000),
    "100,000 elements in xacro": xacro('<xacro:nothing a="1"/>' + "<a/>" * 100_000, is_placed=False),
    "100,000 elements": urdf("<a/>" * 100_000 + '<link name=""/>'),
    "a tag of 1 MB": xacro(f"<xacro:{'a' * 1_000_000}/>"),
}
PYTHON = {
    "Python": computed(f"__import__('os').system('touch {PWNED}')"),
    "a subclass": computed(f"().__class__.__mro__[1].__subclasses__()[0]({TOUCH})"),
    "a subclass in a lambda": computed(f"(lambda: {SUBCLASS}({TOUCH}))()"),
    "a subclass in a list": computed(f"[{SUBCLASS}(one) for one in [{TOUCH}]]"),
    "the globals of a function": computed(f"[f.__globals__['os'].system('touch {PWNED}') for f in [xacro.tokenize]]"),
    "the frame of a generator": computed(
        "[g.append((one.gi_frame.f_back.f_back.f_builtins['__import__']('os').system('touch pwned') for one in g))"
        " or [*g[0]] for g in [[]]]"
    ),
    "a format": computed(r"'\x7b0.__class__.__mro__[9]\x7d'.format(1)"),
    "an eval of substitution": xacro(f"<link name=\"$(eval __import__('os').system('touch {PWNED}'))\"/>"),
    "a file that is written": computed(f"[f.__globals__['open']('{PWNED}', 'w') for f in [xacro.tokenize]]"),
    "an import": computed("[f.__builtins__['__import__']('sqlite3') for f in [xacro.tokenize]]"),
    "limits that are raised": computed(
        "[f.__globals__['sys'].modules['resource'].setrlimit(0, (9, 9)) for f in [xacro.tokenize]]"
    ),
    "a process that answers for itself": computed(
        "[f.__globals__['os']._exit(0) for f in [xacro.tokenize]]", is_placed=False
    ),
}
ENDLESS = {
    "messages without end": computed("[xacro.message('x' * 10 ** 6) for n in range(10 ** 6)]", is_placed=False),
    "output without end": computed(
        "[f.__globals__['os'].write(1, b'x' * 10 ** 6) for f in [xacro.tokenize] for n in range(10 ** 9)]",
        is_placed=False,
    ),
    "an expansion of 9 MB": xacro("".join(
        f'<xacro:property name="p{n}" value="{f"${{p{n - 1}}}" * 10 if n else "a" * 9}"/>' for n in range(7))
        + '\n<link name="${p6}"/>', is_placed=False),
    "a macro of itself": xacro('<xacro:macro name="a"><xacro:a/></xacro:macro>\n<xacro:a/>', is_placed=False),
    "a bare macro of itself": xacro('<macro name="a"><a/><a/></macro>\n<a/>', is_placed=False),
    "macros that double": xacro(f'{DOUBLING}<xacro:macro name="m30"/>\n<xacro:m0/>', is_placed=False),
    "a long list": computed("[x for x in range(10 ** 12)]", is_placed=False),
    "a long sum": computed("python.sum(range(10 ** 12))", is_placed=False),
    "a large power": computed("10 ** 10 ** 10", is_placed=False),
    "a long text": computed("'a' * 10 ** 12"),
    "a text that grows": computed("len([str(n) * 100 for n in range(10 ** 9)])", is_placed=False),
    "much text": xacro("".join(f'<xacro:property name="p{n}" value="{f"${{p{n - 1}}}" * 10 if n else "a" * 9}"/>'
                               for n in range(9)) + '\n<link name="${p8}"/>', is_placed=False),
    "a parameter that takes for ever": xacro(
        f'<xacro:macro name="a" params="b:={"x" * 60}\'"/>\n<xacro:a/>', is_placed=False
    ),
    "a file of itself": xacro('<xacro:include filename="bad.xml"/>'),
    "deep brackets": computed("(" * 5_000 + ")" * 5_000),
    "a lambda of itself": computed("(lambda f: f(f))(lambda f: f(f))"),
    "a property of itself": xacro('<xacro:property name="a" value="${a}"/>\n<link name="${a}"/>'),
}  # fmt: skip
OUTSIDE = {
    "a folder above": xacro('<xacro:include filename="$(find ..)/secret.yaml"/>'),
    "a file of the system": xacro('<xacro:include filename="/etc/passwd"/>'),
    "a file above": xacro('<xacro:include filename="../secret.yaml"/>'),
    "files above": xacro('<xacro:include filename="../*.yaml"/>'),
    "a link that leads out": BadBody(
        "RBX2007", f'{HEAD}<xacro:include filename="link.xml"/></robot>', True,
        prepare=lambda folder: (folder / "link.xml").symlink_to("../secret.yaml"),
    ),
    "a pipe": BadBody(
        "RBX2007", f'{HEAD}<xacro:include filename="pipe"/></robot>', True,
        prepare=lambda folder: os.mkfifo(folder / "pipe"),
    ),
    "YAML elsewhere": computed("xacro.load_yaml('/etc/passwd')"),
    "YAML above": computed("xacro.load_yaml('../secret.yaml')['word']"),
    "the environment": xacro('<link name="$(env HOME)"/>'),
}  # fmt: skip
YAML = {
    "YAML that makes an object": computed(
        "xacro.load_yaml('a.yaml')", {"a.yaml": f"!!python/object/apply:os.system ['touch {PWNED}']".encode()}
    ),
    "YAML that is none": computed("xacro.load_yaml('a.yaml')", {"a.yaml": b"a: [1, 2\n"}),
    "YAML that is a picture": computed("xacro.load_yaml('a.yaml')", {"a.yaml": bytes(range(256)) * 9}),
    "YAML that doubles": computed(
        "str(xacro.load_yaml('a.yaml'))",
        {"a.yaml": b"a0: &a0 [x, x]\n" + b"".join(b"a%d: &a%d [*a%d, *a%d]\n" % (n, n, n - 1, n - 1)
                                                  for n in range(1, 40))},
        is_placed=False,
    ),
}  # fmt: skip
MESHES = {
    "a mesh of 500 MB": BadBody(
        "RBX2015", mesh("big.stl", b"").text, others={"big.stl": b""}, prepare=sparse
    ),
    "a mesh of noise": mesh("noise.stl", bytes(range(256)) * 9),
    "an empty mesh": mesh("empty.stl", b""),
    "a mesh without triangles": mesh("none.stl", stl(0)),
    "a mesh that claims too much": mesh("claim.stl", stl(2, 2**32 - 1)),
    "a text mesh of noise": mesh("noise.obj", bytes(range(256)) * 9),
    "a Collada mesh of noise": mesh("noise.dae", b"\x00" * 99),
    "a Collada mesh with a bomb": mesh("bomb.dae", f"{BOMB}]><COLLADA>&a9;</COLLADA>".encode()),
    "a PLY mesh that claims too much": mesh(
        "claim.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n"
    ),
}  # fmt: skip
VALUES = {
    "NaN in an origin": urdf('<link name="l"><visual><origin xyz="nan 0 0"/><geometry><sphere radius="1"/></geometry>'
                             "</visual></link>"),
    "an infinite angle": urdf(links(2) + fixed(0, 1).replace("<parent", '<origin rpy="0 inf 0"/><parent')),
    "a scale of 1e308": BadBody("RBX2003", mesh("m.stl", b"", 'scale="1e308 1 1"').text, others={"m.stl": stl(1)}),
    "a box of 1e308": urdf('<link name="l"><visual><geometry><box size="1e308 1 1"/></geometry></visual></link>'),
    "an inertia of 1e308": urdf(f'<link name="l"><inertial><mass value="1e308"/>{MATERIAL}</inertial></link>'),
    "an axis of 1e308": urdf(links(2) + fixed(0, 1).replace("fixed", "continuous").replace(
        "<parent", '<axis xyz="1e308 1e308 1e308"/><parent')),
    "a number of 1 MB": urdf(f'<link name="l"><visual><geometry><sphere radius="{"1" * 1_000_000}"/></geometry>'
                             "</visual></link>"),
    "joints in a circle": urdf(links(4) + fixed(1, 2) + fixed(2, 3) + fixed(3, 1), "RBX2006"),
    "a joint of itself": urdf(links(2) + fixed(1, 1), "RBX2006"),
    "a circle of 10,000 joints": urdf(
        links(10_001) + "".join(fixed(n, n % 10_000 + 1) for n in range(1, 10_001)), "RBX2006"),
    "10,000 links in a chain": urdf(
        links(10_000) + "".join(fixed(n, n + 1) for n in range(9_999)) + '<link name=""/>'),
    "10,000 links in a star": urdf(
        links(10_000) + "".join(fixed(0, n) for n in range(1, 10_000)) + '<link name=""/>'),
    "10,000 links of their own": urdf(links(10_000), "RBX2006"),
    "10,000 joints without links": urdf("".join(fixed(n, n + 1) for n in range(10_000)) + links(9_000), "RBX2005"),
    "10,000 joints that mimic nothing": urdf(links(10_001) + "".join(
        fixed(0, n).replace("fixed", "prismatic").replace("</joint>", f'{LIMIT}<mimic joint="x{n}"/></joint>')
        for n in range(1, 10_001)), "RBX2005"),
    "a link with a name of 1 MB": urdf(f'<link name="{"n" * 1_000_000}"/>' * 2, "RBX2004"),
    "a mesh with a name of 1 MB": urdf(f'<link name="l"><visual><geometry><mesh filename="{"n" * 1_000_000}"/>'
                                       "</geometry></visual></link>", "RBX2012"),
}  # fmt: skip
ALL = XML | PYTHON | ENDLESS | OUTSIDE | YAML | MESHES | VALUES
