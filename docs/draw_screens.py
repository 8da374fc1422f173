"""Draws what people see of a run: the log of a patrol, its mission live and as a page, and `top`, each as an SVG.

The screens are those of the commands, at one moment of a run on the stepped clock, so that the same robot gives the
same pictures. A stepped run has no processes of its own, so that `top` lacks their loads. Run it with `make docs`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from rbxcompose.base.levels import level_of
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.missions.components.mission import Mission
from rbxcompose.missions.execution.requests import LookAtMission, ShowPicture
from rbxcompose.missions.view.picture import picture_from_data
from rbxcompose.missions.view.replica import joined, status_list
from rbxcompose.msgs import registry
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.runtime.log import StoryWriter
from rbxcompose.testing.bench import Bench
from rbxcompose.tools import mission_view as live_view
from rbxcompose.tools.inspection.mission_text import running_lines
from rbxcompose.tools.inspection.pages import MISSION_STYLE, mission_html
from rbxcompose.tools.top import lines_of as lines_of_top

DOCS = Path(__file__).parent
ROBOT, MISSION = DOCS.parent / "robots/turtlebot/robot.yaml", "patrol"
WIDTH = 96  # columns
CELL, LINE, LEFT, TOP = 7.2, 17, 16, 46  # of a character, a line, and where the first one begins [px]
MOMENT = "interrupt battery_low:"  # the line of the log at which the screens are taken
BEFORE, AFTER = 5, 9  # lines of the log around it
DOCKING = 3.0  # [s] after it, the mission and the robot are shown: the base is on its way to the dock

PAGE, FRAME, INK = "#1f2733", "#b8bfc7", "#ece7da"
COLOURS = {30: "#66727f", 31: "#ff8a80", 32: "#8fd18b", 33: "#f2c230", 34: "#8ec5ff", 35: "#d6a5f5", 36: "#7fd6d6"}
FAINT = "#93a1b1"
PAGE_FRAME = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 376" width="720" height="376" role="img">
<title>The page of a running mission</title>
<foreignObject width="720" height="376"><div xmlns="http://www.w3.org/1999/xhtml" class="page"><style>
{style}
.page{{padding:12px 16px;height:376px;background:var(--page);color:var(--text);font:13px/1.35 system-ui,sans-serif;
border:1px solid var(--edge);border-radius:8px}}
</style>{body}</div></foreignObject></svg>
"""
_PAINT = re.compile(r"\x1b\[([0-9;]*)m")


def svg(title: str, lines: Sequence[str]) -> str:
    """Return a terminal with a title and lines, whose colours are those of the terminal's codes."""
    width, height = round(2 * LEFT + WIDTH * CELL), TOP + LINE * len(lines)
    dots = "".join(f'<circle cx="{LEFT + 4 + 16 * turn}" cy="17" r="5" fill="#46525f"/>' for turn in range(3))
    texts = "\n".join(text for turn, line in enumerate(lines) if (text := _line(line, TOP + LINE * turn)))
    size = f'viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
    return f"""<svg xmlns="http://www.w3.org/2000/svg" {size} role="img">
<title>{escape(title)}</title>
<style>text {{ font: 12px ui-monospace, Menlo, Consolas, "DejaVu Sans Mono", monospace; white-space: pre }}</style>
<rect x="0.5" y="0.5" width="{width - 1}" height="{height - 1}" rx="8" fill="{PAGE}" stroke="{FRAME}"/>
{dots}<text x="{width / 2:.0f}" y="21" fill="{FAINT}" text-anchor="middle">{escape(title)}</text>
{texts}
</svg>
"""


def _line(line: str, y: int) -> str:
    """Return a line as texts of one colour; each begins at its column, whatever font there is."""
    found, column = [], 0
    for text, colour in _painted(line):
        if text.strip():
            lead = len(text) - len(text.lstrip())
            x, length = LEFT + CELL * (column + lead), CELL * len(text.strip())
            size = f'x="{x:.1f}" y="{y}" textLength="{length:.1f}"'
            found.append(f'<text {size} fill="{colour}">{escape(text.strip())}</text>')
        column += len(text)
    return "".join(found)


def _painted(line: str) -> Iterator[tuple[str, str]]:
    """Yield the pieces of a line with their colours."""
    colour, at = INK, 0
    for match in _PAINT.finditer(line):
        yield line[at : match.start()], colour
        at, codes = match.end(), [int(part) for part in match[1].split(";") if part]
        colours = [COLOURS[code % 60] for code in codes if code % 60 in COLOURS]
        colour = colours[-1] if colours else FAINT if 2 in codes else INK
    yield line[at:], colour


class Run:
    """A patrol on the stepped clock, up to the moment that the screens show."""

    def __init__(self, plan: Plan) -> None:
        self.plan, self.bench = plan, Bench(plan=plan)
        self.heard = {
            (instance.name, wire.port): self.bench.collect(wire.topic, registry.message(wire.type))
            for instance in self.bench.plan.instances
            for wire in instance.wires
            if wire.kind == "out"
        }
        self.charge = self.bench.collect("/battery_level", Float32)
        self.health = self.bench.collect("/diagnostics_agg", DiagnosticArray)
        self.bench.run_until(lambda: any(record.text.startswith(MOMENT) for record in self.bench.records))
        self.bench.advance(DOCKING - 1.0)
        self.counts = {name: len(messages) for name, messages in self.heard.items()}
        self.bench.advance(1.0)

    def log(self) -> list[str]:
        """Return the lines that `up` writes around the moment."""
        bench = Bench(plan=self.plan)
        bench.run_until(lambda: any("battery_low done" in record.text for record in bench.records))
        bench.advance(10.0)
        told = [record for record in bench.records if record.source == "mission"]
        there = next(turn for turn, record in enumerate(told) if record.text.startswith(MOMENT))
        writer = StoryWriter([instance.name for instance in self.plan.instances], colour=True)
        return [writer.line(record) for record in told[there - BEFORE : there + AFTER]]

    def mission(self) -> list[str]:
        """Return the lines of `mission watch`."""
        executive = self._executive()
        picture = picture_from_data(executive.picture(ShowPicture(MISSION)))
        return live_view.lines_of(picture, executive.look_at(LookAtMission(MISSION)), WIDTH, colour=True)

    def page(self) -> str:
        """Return the page of `mission show --format html` of the running robot, in an SVG."""
        executive = self._executive()
        picture = picture_from_data(executive.picture(ShowPicture(MISSION)))
        page = mission_html(picture, status_list(self._seen(), picture.count))
        body = page.partition("<body>")[2].partition("</body>")[0]
        return PAGE_FRAME.format(style=MISSION_STYLE, body=body)

    def top(self) -> list[str]:
        """Return the lines of `top`, without the loads of processes."""
        statuses = {status.name: status for status in self.health[-1].status}
        leaves = {name.rpartition("/")[2]: status for name, status in statuses.items() if name.count("/") > 1}
        components = []
        for instance in self.plan.instances:
            told = leaves.get(instance.name)
            rates = [len(self.heard[key]) - self.counts[key] for key in self.heard if key[0] == instance.name]
            components.append(
                {
                    "name": instance.name,
                    "type": instance.type,
                    "state": "active",
                    "process": instance.process,
                    "restarts": 0,
                    "rate": float(sum(rates)) if any(rates) else None,
                    "level": None if told is None else level_of(told.level).name,
                    "message": "" if told is None else told.message,
                }
            )
        groups = [status for status in statuses.values() if status.name.count("/") == 1]
        picture = {
            "robot": self.plan.robot,
            "is_supervised": True,
            "router": None,
            "mission": "",
            "missions": [self._running()],
            "batteries": {"battery": f"{self.charge[-1].data:.1f} %"},
            "components": components,
            "processes": [],
            "diagnostics": [
                {"group": group.name.lstrip("/"), "level": level_of(group.level).name, "message": group.message}
                for group in groups
            ],
            "warnings": [],
        }
        lines = lines_of_top(picture, WIDTH, 100, colour=True)
        loads = next(turn for turn, line in enumerate(lines) if "process" in line and "memory" in line)
        return [*lines[: loads - 1], *lines[loads + 1 :]]

    def _running(self) -> dict[str, Any]:
        seen = self._seen()
        picture = picture_from_data(self._executive().picture(ShowPicture(MISSION)))
        running = running_lines(picture, status_list(seen, picture.count), WIDTH)
        return {"mission": MISSION, "state": seen["state"], "running": running}

    def _seen(self) -> Mapping[str, Any]:
        return joined({"statuses": {}, "data": {}}, self._executive().look_at(LookAtMission(MISSION)))

    def _executive(self) -> Mission:
        found = self.bench.component("mission")
        if not isinstance(found, Mission):
            raise TypeError("the executive of the patrol robot has another name")
        return found


def pictures() -> dict[str, str]:
    """Return the names of the pictures with their SVG."""
    plan = compile_robot(str(ROBOT), environment={}).plan
    if plan is None:
        sys.exit("the patrol robot has findings: see rbxcompose check robots/turtlebot")
    run = Run(plan)
    return {
        "live_patrol.svg": svg("rbxcompose up --rate max robots/turtlebot", run.log()),
        "live_mission.svg": svg("rbxcompose mission watch", run.mission()),
        "mission_page.svg": run.page(),
        "top.svg": svg("rbxcompose top", run.top()),
    }


if __name__ == "__main__":
    for name, picture in pictures().items():
        (DOCS / name).write_text(picture, encoding="utf-8")
