"""The patrol robot as tests change it."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.testing import Checked, check_file, check_text
from tests.conftest import ROOT


@cache
def checked(*sets: str, text: str = "") -> Checked:
    """Compile it with other values, or with another text of its file."""
    if not text:
        return check_file(ROOT / "robots/turtlebot/robot.yaml", sets=sets)
    mission = (ROOT / "missions/patrol.yaml").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder) / "robots/turtlebot"
        return check_text(text, home, others={"../../missions/patrol.yaml": mission}, sets=sets)


def turtlebot(*sets: str, text: str = "") -> Plan:
    """Return its plan, with other values or with another text of its file."""
    return checked(*sets, text=text).plan
