"""Draws robots: `pi_robot.png` and `porter.png`, their bodies, and `graph.svg`, the graph of the patrol robot.

Run it with `make docs`.
"""

from __future__ import annotations

import io
import re
import sys
from pathlib import Path

from PIL import Image, ImageChops

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.body.picture import draw
from rbxcompose.domains.body.sections.body import body
from rbxcompose.tools.inspection.diagram import diagram_of, folded
from rbxcompose.tools.inspection.pages import STYLE, html

DOCS = Path(__file__).parent
ROBOTS = DOCS.parent / "robots"
GRAPH = "graph.svg"
BORDER = 16  # around a body [pixels]

POSES = {  # joints [rad or m]; all others are at rest
    "pi_robot": {"right_arm_shoulder_lift_joint": -1.1, "right_arm_elbow_flex_joint": -0.3, "head_pan_joint": -0.4},
    "porter": {
        "right_arm_shoulder_pan_joint": 0.35,
        "right_arm_shoulder_lift_joint": -0.5,
        "right_arm_elbow_flex_joint": 1.2,
        "right_arm_wrist_flex_joint": -0.8,
        "right_gripper_left_finger_joint": 0.04,
        "head_tilt_joint": 0.5,
    },
}


def compiled(name: str) -> Robot:
    """Return one of the robots of the library."""
    robot = compile_robot(str(ROBOTS / name), environment={}).robot
    return robot or sys.exit(f"the robot {name} has findings: see rbxcompose check robots/{name}")


def body_picture(robot: str) -> bytes:
    """Return the PNG of a robot's body, without the empty space around it."""
    found = compiled(robot).manifest.contents.of(body) or sys.exit(f"the robot {robot} has no body")
    whole = Image.open(io.BytesIO(draw(found.body, POSES[robot], {})))
    left, top, right, bottom = ImageChops.difference(whole, Image.new("RGB", whole.size, "white")).getbbox() or (0,) * 4
    out = io.BytesIO()
    cut = whole.crop((left - BORDER, top - BORDER, right + BORDER, bottom + BORDER))
    cut.quantize(64).save(out, "PNG", optimize=True)
    return out.getvalue()


def graph(robot: str) -> str:
    """Return the picture of the page that `graph --format html` writes, light or dark as the reader has set it."""
    [picture] = re.findall(r'<svg class="graph".*?</svg>', html(folded(diagram_of(compiled(robot)))), re.DOTALL)
    head, _, inside = picture.partition(">")
    head = head.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg"', 1)
    ground = '<rect width="100%" height="100%" rx="12" style="fill:var(--page)"/>'
    return f"{head}>\n<style>{STYLE}</style>\n{ground}{inside}\n"


def main() -> None:
    """Write the pictures."""
    for robot in POSES:
        (DOCS / f"{robot}.png").write_bytes(body_picture(robot))
    (DOCS / GRAPH).write_text(graph("turtlebot"), encoding="utf-8")


if __name__ == "__main__":
    main()
