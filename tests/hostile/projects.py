"""Projects of several files that are made to do harm: cases by name, each the files and the code that must be told."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

HEAD = "rbx: 1\nkind: Robot\nname: bad\n"
PART = "rbx: 1\nkind: Part\nname: part\n"
MISSION = "rbx: 1\nkind: Mission\nname: bad\n"
BATTERY = "components:\n  battery: {type: battery_sim, runtime: 45 s}\nvalues:\n  battery: battery.battery_level\n"


DRIVING = (
    "components:\n  base: {type: diff_drive_sim}\n  go_to: {type: go_to}\nplaces:\n  home: {x: 1 m, y: 1 m}\n"
    "missions:\n  bad: ../../missions/bad.yaml\nstart: bad\n"
)


def states(count: int, last: str = "wait") -> str:
    """A machine of so many states, one after the other."""
    rows = "".join(f"      s{n}:\n        do:\n          - wait: 1 s\n        next: s{n + 1}\n" for n in range(count))
    end = f"      s{count}:\n        do:\n          - {last}: 1 s\n        next: finished\n"
    return f"do:\n  machine:\n    start: s0\n    states:\n{rows}{end}"


@dataclass(frozen=True, slots=True)
class Project:
    """Files by their path, what else is to be made in the folder, and what must be told of `robots/bad/robot.yaml`."""

    code: str
    files: Mapping[str, str | bytes]
    prepare: Callable[[Path], object] = lambda folder: None
    environment: Mapping[str, str] = field(default_factory=dict)


def robot(text: str) -> dict[str, str | bytes]:
    return {"robots/bad/robot.yaml": HEAD + text}


def mission(text: str) -> dict[str, str | bytes]:
    there = robot(BATTERY + "missions:\n  bad: ../../missions/bad.yaml\nstart: bad\n")
    return {**there, "missions/bad.yaml": MISSION + text}


def named(path: str) -> dict[str, str | bytes]:
    return {**robot(f"missions:\n  bad: {path}\n"), "missions/good.yaml": MISSION + "do: [{wait: 1 s}]\n"}


def body(text: str | bytes) -> dict[str, str | bytes]:
    return {**robot("body: {urdf: bad.urdf}\n"), "robots/bad/bad.urdf": text}


def linked(target: str, name: str = "missions/bad.yaml") -> Callable[[Path], object]:
    def prepare(folder: Path) -> None:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).symlink_to(target)

    return prepare


def pipe(folder: Path) -> None:
    (folder / "missions").mkdir(exist_ok=True)
    (folder / "missions/bad.yaml").unlink(missing_ok=True)
    os.mkfifo(folder / "missions/bad.yaml")


def included(*names: str) -> str:
    return "include:\n" + "".join(f"  i{number}: {{part: {name}}}\n" for number, name in enumerate(names))


def chain(length: int) -> dict[str, str | bytes]:
    """Return a robot that includes a part that includes a part and so on."""
    parts = {f"parts/p{n}.yaml": PART + included(f"p{n + 1}.yaml") for n in range(length)}
    last = {f"parts/p{length}.yaml": PART + BATTERY}
    return {**robot(included("../../parts/p0.yaml")), **parts, **last}


def doubling(levels: int) -> dict[str, str | bytes]:
    """Return a robot whose parts each include two parts: few files, many instances."""
    parts = {f"parts/p{n}.yaml": PART + included(f"p{n + 1}.yaml", f"p{n + 1}.yaml") for n in range(levels)}
    return {**robot(included("../../parts/p0.yaml")), **parts, f"parts/p{levels}.yaml": PART + BATTERY}


def many(count: int, text: str) -> dict[str, str | bytes]:
    parts: dict[str, str | bytes] = {f"parts/p{n}.yaml": PART + text for n in range(count)}
    return {**robot(included(*(f"../../parts/p{n}.yaml" for n in range(count)))), **parts}


def compared(number: int) -> str:
    """Return a condition of 990 characters, another one for each number."""
    return " or ".join(f"$battery > {number + n / 100:.2f} %" for n in range(43))


def strangers(count: int) -> str:
    """Return many names that are nearly, but not quite, those that exist."""
    components = "".join(f"  battery_{n}: {{type: battery_sim, runtime: 45 s}}\n" for n in range(count))
    return (
        "components:\n"
        + components
        + "values:\n"
        + "".join(f"  v{n}: batery_{n}x.battery_level\n" for n in range(count))
    )


ARGUMENT = "args:\n  long: {type: text, default: " + "x" * 60_000 + "}\n"
PROJECTS: dict[str, Project] = {
    # Files: which, how many, how large
    "a robot that is a link to a file of the system": Project(
        "RBX1306", {}, linked("/etc/passwd", "robots/bad/robot.yaml")
    ),
    "900 missions that are missing in a folder of 900": Project(
        "RBX1301",
        {
            **robot("missions:\n" + "".join(f"  m{n}: ../../missions/n{n}.yaml\n" for n in range(900))),
            **{f"missions/z{n}.yaml": MISSION for n in range(900)},
        },
    ),
    "a link to a device": Project("RBX1301", {}, linked("/dev/zero", "robots/bad/robot.yaml")),
    "a link to a file of the system": Project("RBX1306", named("../../missions/bad.yaml"), linked("/etc/passwd")),
    "a link to itself": Project("RBX1306", named("../../missions/bad.yaml"), linked("bad.yaml")),
    "a path out of the project": Project("RBX1306", named("../../../../../../../../etc/passwd")),
    "an absolute path": Project("RBX1306", named("/etc/passwd")),
    "a path out of the library": Project("RBX1306", named("rbx:../../../../etc/passwd")),
    "a device as a mission": Project("RBX1306", named("/dev/zero")),
    "a folder as a mission": Project("RBX1301", named("../../missions")),
    "the robot as its own mission": Project("RBX1304", named("robot.yaml")),
    "a name too long for the system": Project("RBX1306", named("x" * 5000)),
    "a zero byte in a path": Project("RBX1106", named('"a\\0b"')),
    "a part that includes itself": Project(
        "RBX1308", {**robot(included("../../parts/p.yaml")), "parts/p.yaml": PART + included("p.yaml")}
    ),
    "a long chain of parts": Project("RBX1103", chain(40)),
    "doubling parts": Project("RBX1103", doubling(14)),
    "600 parts": Project("RBX1103", many(600, BATTERY)),
    "many large parts": Project("RBX1103", many(6, "about: x\n" + "# x\n" * 450_000)),
    "a pipe as a mission": Project("RBX1301", named("../../missions/bad.yaml"), pipe),
    "a part behind a link that leads out": Project(
        "RBX1306", robot(included("../../parts/p.yaml")), linked("/etc/hostname", "parts/p.yaml")
    ),
    "a secret behind a link that leads out": Project(
        "RBX1207",
        robot("components:\n  b: {type: battery_sim, runtime: '${secret.key}'}\n"),
        linked("/etc/passwd", "secrets/key"),
    ),
    "a mission in utf-16": Project(
        "RBX1111", {**mission(""), "missions/bad.yaml": (MISSION + "do: [{wait: 1 s}]\n").encode("utf-16")}
    ),
    "a mission of 3 MB": Project("RBX1103", mission("# x\n" * 800_000)),
    "aliases that double in a part": Project(
        "RBX1108",
        {
            **robot(included("../../parts/p.yaml")),
            "parts/p.yaml": PART
            + "a0: &a0 [x]\n"
            + "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 12)),
        },
    ),
    "a direction override in a part": Project(
        "RBX1106", {**robot(included("../../parts/p.yaml")), "parts/p.yaml": PART + 'about: "a\u202eb"\n'}
    ),
    # Filling in
    "a long argument in many texts": Project(
        "RBX1103", robot(ARGUMENT + "about: [" + '"b${args.long}",' * 9000 + "]\n")
    ),
    "a long list filled in many times": Project(
        "RBX1103",
        robot("args:\n  l: {type: list, default: [" + "1," * 90_000 + "]}\nabout: [" + "'${args.l}'," * 10_000 + "]\n"),
    ),
    "an argument of itself": Project("RBX1202", robot("args:\n  a: {type: text, default: '${args.a}${args.a}'}\n")),
    "a long variable in many texts": Project(
        "RBX1103", robot("about: [" + '"b${env.LONG}",' * 9000 + "]\n"), environment={"LONG": "x" * 60_000}
    ),
    "a variable that names itself": Project("RBX1102", robot("about: [${env.A}]\n"), environment={"A": "${env.A}"}),
    "a variable with an escape": Project("RBX1001", robot("${env.A}: 1\n"), environment={"A": "\x1b[2J"}),
    "one text filled with a long argument 5,000 times": Project(
        "RBX1103", robot(ARGUMENT + "about: '" + "${args.long}" * 5000 + "'\n")
    ),
    "100,000 expressions in 30 texts": Project(
        "RBX1103", robot("about: [" + ("'" + "${1 + 1}" * 3500 + "',") * 30 + "]\n")
    ),
    "2,000 names near 99 arguments": Project(
        "RBX1202",
        robot(
            "args:\n"
            + "".join(f"  a{n:02}{'a' * 50}: {{type: speed, default: 1 m/s}}\n" for n in range(99))
            + "about: ["
            + "".join(f"'${{args.a{n}{'a' * 50}}}'," for n in range(100, 2100))
            + "]\n"
        ),
    ),
    # XML
    "a URDF of 5 MB": Project("RBX1103", body("<robot>" + " " * 5_000_000 + "</robot>")),
    "200,000 elements of a URDF": Project("RBX1103", body("<robot>" + "<a/>" * 200_001 + "</robot>")),
    "100,000 elements inside each other": Project("RBX1103", body("<robot>" + "<a>" * 100_000)),
    "entities that double in a URDF": Project(
        "RBX2001",
        body(
            '<!DOCTYPE robot [<!ENTITY a0 "x">'
            + "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12))
            + "]><robot>&a11;</robot>"
        ),
    ),
    "a file of the system as an entity": Project(
        "RBX2001", body('<!DOCTYPE robot [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot>&a;</robot>')
    ),
    "a DOCTYPE from elsewhere": Project("RBX2001", body('<!DOCTYPE robot SYSTEM "http://127.0.0.1/a.dtd"><robot/>')),
    "a name of 3 MB in a URDF": Project("RBX2002", body(f"<{'a' * 3_000_000}/>")),
    "an element of 3 MB that never ends": Project("RBX2001", body(f"<robot><{'a' * 3_000_000}></robot>")),
    "many attributes in a URDF": Project(
        "RBX2001", body("<robot " + " ".join(f'a{n}="1"' for n in range(300_000)) + "></b>")
    ),
    "an escape in a URDF": Project("RBX2001", body("<robot>\x1b[2J</robot>")),
    "a direction override in a URDF": Project("RBX2001", body("<robot>\u202e\u0085</b>")),
    "a URDF in utf-16": Project("RBX1111", body("<robot/>".encode("utf-16"))),
    "a URDF of another encoding": Project("RBX2001", body('<?xml version="1.0" encoding="utf-7"?><robot/>')),
    "a URDF out of the project": Project("RBX1306", robot("body: {urdf: /etc/passwd}\n")),
    "a device as a URDF": Project(
        "RBX1306", robot("body: {urdf: bad.urdf}\n"), linked("/dev/zero", "robots/bad/bad.urdf")
    ),
    # Expressions
    "an expression of 1,001 characters": Project("RBX4111", mission("do: [{check: " + "1 + " * 249 + "1 < 20000}]\n")),
    "51 brackets": Project("RBX4111", mission("do: [{check: '" + "(" * 51 + "1" + ")" * 51 + " < 2'}]\n")),
    "many minuses": Project("RBX4111", mission("do: [{check: '" + "-" * 900 + "1 < 2'}]\n")),
    "a power": Project("RBX4111", mission("do: [{check: '9 ** 9 ** 9 < 2'}]\n")),
    "an attribute": Project("RBX4111", mission("do: [{check: '().__class__ == 1'}]\n")),
    "a function of Python": Project("RBX4111", mission("do: [{check: 'eval(1) == 1'}]\n")),
    # Missions
    "100 levels of nodes": Project("RBX1103", mission("do: " + "[" * 100 + "go" + "]" * 100 + "\n")),
    "10,000 unknown skills": Project("RBX4102", mission("do:\n" + "  - fly_away\n" * 10_000)),
    "5,000 unknown skills, each another": Project(
        "RBX4102", mission("do:\n" + "".join(f"  - recharg{n}e\n" for n in range(5000)))
    ),
    "5,000 interrupts": Project(
        "RBX4102",
        mission(
            "do: [{wait: 1 s}]\ninterrupts:\n"
            + "".join(f"  i{n}: {{when: $battery < 1 %, do: x}}\n" for n in range(5000))
        ),
    ),
    "3,000 branches that need the base": Project(
        "RBX4152", {**mission("do:\n  parallel:\n" + "    - go_to: home\n" * 3_000), **robot(DRIVING)}
    ),
    "10,000 states": Project("RBX1103", mission(states(10_000))),
    "900 states in a row": Project("RBX4102", mission(states(900, "fly"))),
    "9,000 misspelt names": Project("RBX4102", mission("do:\n" + "".join(f"  - fly_{n}: x\n" for n in range(9_000)))),
    "60,000 steps": Project("RBX1103", mission("do:\n" + "  - wait: 1 s\n" * 60_000)),
    "30,000 values in a mission": Project("RBX1103", mission("do:\n" + "  - fly\n" * 30_000)),
    "a mission of 9,000 values listed 400 times": Project(
        "RBX1103",
        {
            **robot("missions:\n" + "".join(f"  m{n}: ../../missions/bad.yaml\n" for n in range(400))),
            "missions/bad.yaml": "rbx: 1\nkind: Mission\nname: bad\ndo:\n" + "  - wait: 1 s\n" * 4_500,
        },
    ),
    "a part of 5,000 values included 100 times": Project(
        "RBX1103",
        {
            **robot("include:\n" + "".join(f"  p{n}: ../../parts/p.yaml\n" for n in range(100))),
            "parts/p.yaml": "rbx: 1\nkind: Part\nname: p\nplaces:\n"
            + "".join(f"  q{n}: {{x: 1 m, y: 1 m}}\n" for n in range(900)),
        },
    ),
    "100 missions that each use all later ones": Project(
        "RBX4147",
        {
            **robot("missions:\n" + "".join(f"  m{n}: ../../missions/m{n}.yaml\n" for n in range(100))),
            **{
                f"missions/m{n}.yaml": f"rbx: 1\nkind: Mission\nname: m{n}\ndo:\n"
                + "".join(f"  - use: m{m}\n" for m in range(n + 1, 100))
                + "  - wait: 1 s\n"
                for n in range(100)
            },
        },
    ),
    "3,000 stored nodes run in 1,400 places": Project(
        "RBX4147",
        mission(
            "data:\n  chores:\n"
            + "    - wait: 1 s\n" * 3_000
            + "do:\n"
            + "  - {for: c, in: $chores, do: {run: $c}}\n" * 1_400
        ),
    ),
    "stored nodes that run all stored nodes": Project(
        "RBX4147", mission("data:\n  a:\n" + "    - {for: d, in: $a, do: {run: $d}}\n" * 300 + "do: {run: '$a[0]'}\n")
    ),
    "1,900 conditions of 990 characters": Project(
        "RBX4147", mission("do:\n" + "".join(f"  - check: {compared(n)}\n" for n in range(1_900)))
    ),
    "30 texts with 7,000 names each": Project("RBX4147", mission("do:\n" + f"  - log: {'$battery ' * 7_000}\n" * 30)),
    "2,000 loops over 8,900 places": Project(
        "RBX4102",
        {
            **mission(
                "data:\n  l: ["
                + "home, " * 8_900
                + "]\ndo:\n"
                + "  - {for: c, in: $l, do: {go_to: $c}}\n" * 2_000
                + "  - fly\n"
            ),
            **robot(DRIVING),
        },
    ),
    "1,100 components": Project(
        "RBX1103", robot("components:\n" + "".join(f"  c{n}: {{type: go_to}}\n" for n in range(1_100)))
    ),
    "1,000 profiles": Project(
        "RBX7003", robot("profiles:\n" + "".join(f"  p{n}: {{about: {n}}}\n" for n in range(1_000)))
    ),
    "20 profiles over 19,000 values": Project(
        "RBX7003",
        robot(
            "about: ["
            + "1," * 19_000
            + "]\nprofiles:\n"
            + "".join(f"  p{n}: {{places: {{z: {{x: 1 m, y: 1 m}}}}}}\n" for n in range(20))
        ),
    ),
    "parts that bring 8,000 components": Project(
        "RBX1103",
        {
            **robot("include:\n" + "".join(f"  i{n}: p.yaml\n" for n in range(8))),
            "robots/bad/p.yaml": PART + "components:\n" + "".join(f"  b{n}: {{type: go_to}}\n" for n in range(950)),
        },
    ),
    "a start order of 60 components with 2^59 paths": Project(
        "RBX3011",
        robot(
            "components:\n"
            + "".join(
                f"  g{n}: {{type: chore_sim, connect: {{cmd_vel: u{n}, chore: s{n}}}, "
                f"starts_after: [{', '.join(f'g{m}' for m in range(n))}]}}\n"
                for n in range(60)
            )
        ),
    ),
    "10,000 patterns for 900 components": Project(
        "RBX1103",
        robot(
            "components:\n"
            + "".join(f"  c{n}: {{type: chore_sim, connect: {{cmd_vel: u{n}, chore: s{n}}}}}\n" for n in range(900))
            + "diagnostics:\n  analyzers:\n    a: {match: ["
            + "".join(f"'*c{n % 900}{'*' * (n // 900)}'," for n in range(10_000))
            + "]}\n"
        ),
    ),
    "90,000 unknown keys": Project("RBX1103", robot("".join(f"k{n}: 1\n" for n in range(90_000)))),
    "a loop over 19,000 items": Project("RBX4102", mission("do: [{for: x, in: [" + "1," * 19_000 + "], do: fly}]\n")),
    "50,000 items inside each other": Project(
        "RBX1103", mission("data:\n  a: [" + "[1, 2, 3, 4]," * 10_000 + "]\ndo: [{log: $a}]\n")
    ),
    "an input of 20,000 values": Project(
        "RBX1103", robot("missions: {work: {file: ../../missions/work.yaml, with: {a: [" + "1," * 20_000 + "]}}}\n")
    ),
    # Names
    "1,000 names that are nearly right": Project("RBX3005", robot(strangers(1000))),
    "5,000 unknown keys": Project("RBX1001", robot("".join(f"componentz{n}: 1\n" for n in range(5000)))),
    "a pattern that matches in many ways": Project(
        "RBX5001",
        robot(
            BATTERY
            + "diagnostics:\n  analyzers:\n"
            + "".join(f'    a{n}: {{match: ["{"*a" * 90}b"]}}\n' for n in range(300))
        ),
    ),
    "components that start after each other": Project(
        "RBX3008",
        robot(
            "components:\n"
            + "".join(f"  c{n}: {{type: go_to, starts_after: [c{(n + 1) % 1000}]}}\n" for n in range(1000))
        ),
    ),
}


def write(project: Project, folder: Path) -> Path:
    """Write down the files and return that of the robot."""
    robot_file = folder / "robots/bad/robot.yaml"
    robot_file.parent.mkdir(parents=True)
    for name, text in project.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    project.prepare(folder)
    return robot_file
