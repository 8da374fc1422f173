"""Fenced blocks of pages, and the project in which the manifests among them are compiled: that of the patrol robot."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rbxcompose.testing.manifests import Checked, check_text

ROOT = Path(__file__).parents[2]
WITH_BODY = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
# An example may bring another body; with the profiles of the robot's own, each would be compiled four times.
ROBOT = re.sub(r"^(body|profiles):\n(  .*\n)+\n?", "", WITH_BODY, flags=re.MULTILINE)
PATROL = (ROOT / "missions/patrol.yaml").read_text(encoding="utf-8")
HEADER = "rbx: 1\nkind: Mission\nname: example\n"
EXAMPLE = f"{HEADER}do: recharge\n"
URDF = """<robot name="example">
  <link name="base_footprint"/>
  <link name="base_link"/>
  <joint name="base_joint" type="fixed"><parent link="base_footprint"/><child link="base_link"/></joint>
  <link name="head"/>
  <joint name="pan_joint" type="revolute">
    <parent link="base_link"/><child link="head"/><limit lower="-2" upper="2" effort="1" velocity="2"/>
  </joint>
</robot>
"""
NAVIGATION = "world: rbx:worlds/house.yaml\nnavigation:\n  planner: {patience: 15 s}\n  costs: {map_only: true}\n"
TAGS = """
components:
  follow_tag: {type: tag_follower, speed: 0.3 m/s, turn_rate: 50 deg/s}
muxes:
  cmd_vel:
    inputs:
      navigation: {from: go_to, priority: 10, timeout: 0.5 s}
      tag: {from: follow_tag, priority: 12, timeout: 0.5 s}
"""
FOLLOWER = f"""{NAVIGATION}  people: {{}}
muxes:
  cmd_vel:
    inputs:
      navigation: {{from: go_to, priority: 10, timeout: 0.5 s}}
      following: {{from: follow_person, priority: 12, timeout: 0.5 s}}
"""
HEAD = """
body: {urdf: robot.urdf}
buses: {servos: {type: dynamixel}}
actuators: {pan_servo: {bus: servos, model: AX-12, id: 1}}
joints: {pan_joint: {actuator: pan_servo, limits: {acceleration: 360 deg/s^2}}}
controllers: {head: {type: joint_trajectory, joints: [pan_joint]}}
arms: {neck: {joints: [pan_joint], controller: head, poses: {ahead: {pan_joint: 0 deg}, aside: {pan_joint: 60 deg}}}}
"""  # of a mission that says `head` behind its fence

WALKED_THROUGH = ("tutorial.md", "missions.md", "sdk.md", "systems.md")  # their manifests need each other, or a package

_FENCE = re.compile(r"^```(?P<info>[^\n`]*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
_SECTION = re.compile(r"^(?=[^\s#])", re.MULTILINE)
_ENTRY = re.compile(r"^(?=  [^\s#])", re.MULTILINE)
_GO_TO = re.compile(r"^( +)go_to:\n(\1  .*\n)+", re.MULTILINE)
_SPEED = re.compile(r"^args:\n(  .*\n)+", re.MULTILINE)
_WORK = re.compile(r"^(do|machine):", re.MULTILINE)
_MISSION_FILE = re.compile(r"(?:\.\./)*missions/")  # however far above the robot's file a page sees it
_NAMED_MISSION = re.compile(r"\.\./\.\./missions/\w+\.yaml")


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block: its page and line, the words behind the fence, what stands inside."""

    page: str
    line: int
    words: tuple[str, ...]
    text: str

    @property
    def language(self) -> str:
        return self.words[0] if self.words else ""

    @property
    def wrong(self) -> str | None:
        """The code that `check` must give, for an example of a mistake."""
        return self.words[self.words.index("wrong") + 1] if "wrong" in self.words else None

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


ROBOTS = {
    "head": HEAD,
    "navigation": NAVIGATION,
    "follower": FOLLOWER,
    "tags": TAGS,
}  # what the robot of a mission has besides, by a word of its block


def blocks_of(text: str, page: str) -> Iterator[Block]:
    for match in _FENCE.finditer(text):
        yield Block(page, text.count("\n", 0, match.start()) + 1, tuple(match["info"].split()), match["text"])


def page_blocks(language: str, trials: bool = False) -> list[Block]:
    """Return the blocks of one language in all pages but those of findings: tests of missions, or all others."""
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    pages += sorted((ROOT / "docs/reference").glob("*.md"))
    found = (block for page in pages for block in blocks_of(page.read_text(encoding="utf-8"), page.name))
    known = (block for block in found if block.language != "yaml" or not is_walked_through(block))
    return [block for block in known if block.language == language and ("test" in block.words) == trials]


def is_walked_through(block: Block) -> bool:
    """Tell whether a test follows the whole page of a manifest, from its first block to its last."""
    return block.page in WALKED_THROUGH


def checked(block: Block, folder: Path) -> Checked:
    """Compile the manifest or the fragment that a block holds."""
    kind = next((word for word in ("robot", "mission") if word in block.words[1:]), "")
    if kind == "mission":
        more = next((text for word, text in ROBOTS.items() if word in block.words), "")
        return check_mission(HEADER + block.text, folder, more)
    if kind == "robot":
        return check_robot(with_sections(ROBOT, block.text), folder, profiles=profiles_of(block.text))
    if "\nkind: Mission\n" in block.text:
        return check_mission(block.text, folder)
    if "\nkind: Part\n" in block.text:
        return check_part(block.text, folder)
    if "\nkind: World\n" in block.text:
        return check_world(block.text, folder)
    if "\nkind: Overlay\n" in block.text:
        return check_overlay(block.text, folder)
    return check_robot(block.text, folder)


def check_part(text: str, folder: Path) -> Checked:
    """Compile the patrol robot with an instance of a part."""
    path = folder / "parts" / "example.yaml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return check_robot(with_sections(ROBOT, "include:\n  example: ../../parts/example.yaml\n"), folder)


def check_world(text: str, folder: Path) -> Checked:
    """Compile the patrol robot in a world."""
    path = folder / "worlds" / "example.yaml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return check_robot(with_sections(ROBOT, "world: ../../worlds/example.yaml\n"), folder)


def check_overlay(text: str, folder: Path) -> Checked:
    """Compile the patrol robot with an overlay."""
    path = folder / "example.yaml"
    path.write_text(text, encoding="utf-8")
    return check_robot(ROBOT, folder, overlays=[str(path)])


def check_mission(text: str, folder: Path, more: str = "") -> Checked:
    """Compile the patrol robot with more sections and a mission; one that does not say what to do recharges."""
    whole = text if _WORK.search(text) else f"{text}do: recharge\n"
    robot = with_sections(ROBOT, f"{more}missions:\n  example: ../../missions/example.yaml\n")
    return check_robot(robot, folder, example=whole)


def check_robot(
    text: str,
    folder: Path,
    *,
    profiles: Sequence[str] = (),
    overlays: Sequence[str] = (),
    real: bool = False,
    example: str = EXAMPLE,
) -> Checked:
    robot = _MISSION_FILE.sub("../../missions/", text)
    others = dict.fromkeys(_NAMED_MISSION.findall(robot), example)  # a page shows a robot before its mission
    others |= {
        "robot.urdf": URDF,
        "msgs/my_msgs/msg/Grasp.msg": "float64 width\n",
        "../../missions/patrol.yaml": PATROL,
        "../../missions/example.yaml": example,
    }
    home = folder / "robots" / "example"
    return check_text(robot, home, others=others, profiles=profiles, overlays=overlays, real=real, environment={})


def with_sections(robot: str, fragment: str) -> str:
    """Return a robot's text with the sections of a fragment: an entry takes the place of the one of its name.

    Navigation brings a component `go_to` of its own.
    """
    if re.search("^navigation:", fragment, re.MULTILINE):
        robot = _SPEED.sub("", _GO_TO.sub("", robot))
    sections = _parts(robot, _SECTION)
    for name, section in _parts(fragment, _SECTION).items():
        entries = {**_parts(sections.get(name, ""), _ENTRY), **_parts(section, _ENTRY)}
        is_map = bool(_parts(section, _ENTRY))
        sections[name] = f"{name}:\n{''.join(entries.values())}" if is_map else section
    return "".join(sections.values())


def profiles_of(fragment: str) -> list[str]:
    return list(_parts(_parts(fragment, _SECTION).get("profiles", ""), _ENTRY))


def _parts(text: str, begins: re.Pattern[str]) -> dict[str, str]:
    pieces = begins.split(text)[1:]
    return {piece.partition(":")[0].strip(): piece for piece in pieces}
