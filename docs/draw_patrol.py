"""Draws `patrol.svg`, the picture of the README: YAML on the left, the way that the base drives on the right.

The way is that of a run on the stepped clock, so that the same robot gives the same picture. Run it with `make docs`.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.sdk.component import MissionOver
from rbxcompose.testing.bench import Bench

ROOT = Path(__file__).parents[1]
ROBOT, MISSION = ROOT / "robots/turtlebot/robot.yaml", ROOT / "missions/patrol.yaml"
PICTURE = ROOT / "docs/patrol.svg"

LEFT, TOP, LINE, CELL = 36, 44, 18, 7.2  # of the excerpt [px]
ORIGIN, SCALE = (545, 306), 250  # where the map's origin is [px], and what a metre is [px]
LEGEND = (480, 354, 20)  # where it begins, and the height of its lines [px]
STEP = 0.02  # [m] between two points of the way

INK, FAINT, WAY, DETOUR = "#1f2933", "#66727f", "#3d7dca", "#e07a1f"
KEY, VALUE, HEAD = "#8ec5ff", "#ece7da", "#93a1b1"
COLOURS = {"yellow": "#f2c230", "red": "#e0453a", "green": "#3fa35b", "blue": "#3d6fd6", "white": "#ffffff"}

FRAME = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 900 420" width="900" height="420" role="img">
<title>A patrol in YAML, and the way that the base drives</title>
<style>text {{ font: 13px system-ui, "Segoe UI", "DejaVu Sans", sans-serif }}
.code {{ font: 12px ui-monospace, Menlo, Consolas, "DejaVu Sans Mono", monospace }}
@media (prefers-color-scheme: dark) {{ .paper {{ fill: #151b23; stroke: #3d444d }}
[stroke="{ink}"] {{ stroke: #dfe5ec }} text[fill="{ink}"] {{ fill: #dfe5ec }}
text[fill="{faint}"] {{ fill: #a3afbb }} }}</style>
<rect class="paper" x="0.5" y="0.5" width="899" height="419" rx="12" fill="#fbfaf7" stroke="#b8bfc7"/>
<rect x="14" y="14" width="430" height="392" rx="8" fill="#1f2733"/>
{inside}
</svg>
"""


@dataclass(frozen=True, slots=True)
class Drive:
    """What the base did: its way [s, m, m], when it left it and when the corner was reached after all [s]."""

    way: list[tuple[float, float, float]]
    left: float
    back: float
    battery: str

    def between(self, start: float, end: float) -> list[tuple[float, float]]:
        """Return the way from one time to another."""
        return [(x, y) for time, x, y in self.way if start <= time <= end]


def drive() -> Drive:
    """Run the patrol robot in virtual time until its mission has ended."""
    plan = compile_robot(str(ROBOT), environment={}).plan
    if plan is None:
        sys.exit("the patrol robot has findings: see rbxcompose check robots/turtlebot")
    bench = Bench(plan=plan)
    odometry = bench.collect("/odom", Odometry)
    bench.run_until(lambda: any(isinstance(event, MissionOver) for event in bench.events))
    told = [(record.time, record.text) for record in bench.records if record.source == "mission"]
    left, words = next((time, text) for time, text in told if text.startswith("interrupt battery_low:"))
    resumed = next(time for time, text in told if text.startswith("interrupt battery_low done"))
    back = next(time for time, text in told if time > resumed and ": success" in text)
    return Drive(list(thinned(odometry)), left, back, words.partition("(battery ")[2].rstrip(")"))


def thinned(odometry: Iterable[Odometry]) -> Iterator[tuple[float, float, float]]:
    """Yield times and places [s, m, m] that are some way from each other."""
    last = (math.inf, math.inf)
    for message in odometry:
        at, stamp = message.pose.pose.position, message.header.stamp
        if math.dist((at.x, at.y), last) >= STEP:
            last = (at.x, at.y)
            yield stamp.sec + stamp.nanosec / 1e9, at.x, at.y


def excerpt() -> Iterator[str]:
    """Yield lines of the two manifests; one that begins with `#` names the file."""
    robot, mission = ROBOT.read_text(encoding="utf-8"), MISSION.read_text(encoding="utf-8")
    yield f"# {ROBOT.relative_to(ROOT)}"
    yield from (re.sub(r", heading: [^,}]+", "", line) for line in section(robot, "places"))
    yield from section(robot, "components")[:4]
    yield ""
    yield f"# {MISSION.relative_to(ROOT)}"
    yield from section(mission, "interrupts")


def section(text: str, name: str) -> list[str]:
    """Return the lines of a section without their comments."""
    _, _, rest = text.partition(f"\n{name}:\n")
    lines = re.split(r"^\S", rest, maxsplit=1, flags=re.MULTILINE)[0].splitlines()
    return [f"{name}:", *(re.sub(r"\s+#.*", "", line) for line in lines if line.strip())]


def code() -> Iterator[str]:
    """Yield the excerpt as text in two colours."""
    for number, line in enumerate(excerpt()):
        x, y = LEFT + CELL * (len(line) - len(line.lstrip())), TOP + LINE * number
        key, colon, rest = line.strip().partition(":")
        if line.startswith("#"):
            yield f'<text class="code" x="{x:.1f}" y="{y:.1f}" fill="{HEAD}">{escape(line[2:])}</text>'
        elif colon:
            spans = f'<tspan fill="{KEY}">{escape(key)}:</tspan>{escape(rest)}'
            yield f'<text class="code" x="{x:.1f}" y="{y:.1f}" fill="{VALUE}">{spans}</text>'
        elif line:
            yield f'<text class="code" x="{x:.1f}" y="{y:.1f}" fill="{VALUE}">{escape(line.strip())}</text>'


def pixel(x: float, y: float) -> tuple[float, float]:
    """Return where a point of the map [m] is in the picture [px]."""
    return ORIGIN[0] + SCALE * x, ORIGIN[1] - SCALE * y


def line(points: Iterable[tuple[float, float]], colour: str, width: float) -> str:
    """Return a line through points of the map."""
    along = " ".join("{:.1f},{:.1f}".format(*pixel(x, y)) for x, y in points)
    return f'<polyline points="{along}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"/>'


def places() -> Iterator[str]:
    """Yield the corners and the dock, each in its colour and with its name."""
    text = ROBOT.read_text(encoding="utf-8")
    written = re.findall(r"^  (\w+): {x: (\S+) m, y: (\S+) m,.* colour: (\w+)}$", text, re.MULTILINE)
    for name, x, y, colour in written:
        px, py = pixel(float(x), float(y))
        shape = f'stroke="{INK}" stroke-width="1.5" fill="{COLOURS[colour]}"'
        if name == "dock":
            yield f'<rect x="{px - 12:.1f}" y="{py - 12:.1f}" width="24" height="24" rx="4" {shape}/>'
        else:
            yield f'<circle cx="{px:.1f}" cy="{py:.1f}" r="10" {shape}/>'
        yield label(px, py + (-20 if float(y) > 0 else 27), name, FAINT, "middle")


def label(x: float, y: float, text: str, colour: str, anchor: str = "start") -> str:
    """Return a line of text."""
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}">{escape(text)}</text>'


def badge(x: float, y: float, number: int) -> str:
    """Return a number in a filled circle."""
    circle = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="9" fill="{DETOUR}"/>'
    return circle + label(x, y + 4.5, str(number), "#ffffff", "middle")


def captions(driven: Drive) -> Iterator[str]:
    """Yield what happens in words, and numbers at the places where it happens."""
    x, y, height = LEGEND
    leaving, dock, corner = pixel(*driven.between(driven.left, driven.back)[0]), pixel(0.5, 0.5), pixel(1.0, 0.0)
    spots = ((leaving[0], leaving[1] + 22), (dock[0] + 28, dock[1]), (corner[0] + 26, corner[1]))
    words = (
        f"The battery is at {driven.battery}: the interrupt cuts the way short",
        "The robot docks and recharges",
        "It goes on to the corner that it was driving to",
    )
    for number, ((spot_x, spot_y), text) in enumerate(zip(spots, words, strict=True), 1):
        yield badge(spot_x, spot_y, number)
        yield badge(x, y + height * (number - 1), number)
        yield label(x + 18, y + 4.5 + height * (number - 1), text, INK)


def picture() -> str:
    """Return the SVG."""
    driven = drive()
    before, after = driven.between(0, driven.left), driven.between(driven.back, math.inf)
    detour = line(driven.between(driven.left, driven.back), DETOUR, 3)
    parts = [*code(), line(before, WAY, 3), line(after, WAY, 3), detour, *places(), *captions(driven)]
    return FRAME.format(inside="\n".join(parts))


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
