"""A running mission, live: its nodes with their states, its data, its last transitions."""

import json
import sys
import time
from collections.abc import Mapping
from typing import Any

from rbxcompose.base.printable import fitted, plain
from rbxcompose.commands.console import emit, has_colour
from rbxcompose.commands.lookup import answer_of
from rbxcompose.commands.terminal import LiveScreen, is_terminal
from rbxcompose.missions.execution.requests import LookAtMission, ShowPicture
from rbxcompose.missions.view.picture import MissionPicture, picture_from_data
from rbxcompose.missions.view.replica import ACTIVE, joined, status_list
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.tools.inspection.mission_text import mission_lines

MOST = 5  # transitions that are shown
_WIDTH = 120  # columns of a picture without a terminal


def lines_of(picture: MissionPicture, seen: Mapping[str, Any], width: int, *, colour: bool = False) -> list[str]:
    """Return the lines that show the state of a mission."""
    statuses = status_list(joined({"statuses": {}, "data": {}}, seen), picture.count)
    stops = ", ".join(f"{stop['place']} ({stop['text']})" for stop in seen.get("stopped_at", ()))
    at = f" at {plain(stops)}" if stops else ""
    lines = [fitted(f"mission {plain(seen['mission'])}: {seen['state']}{at}", width)]
    lines += mission_lines(picture, statuses, width=width, colour=colour)
    if seen["shown"]:
        values = ", ".join(f"{name} {text or '(empty)'}" for name, text in seen["shown"].items())
        lines.append(fitted(f"data: {plain(values, 400)}", width))
    for one in seen["transitions"][-MOST:]:
        lines.append(fitted(f"{one['time']:9.2f}  {one['state']} -> {one['to']}  ({one['outcome']})", width))
    return lines


def follow(folder: RobotFolder, name: str, period: float) -> int:
    """Print a mission as JSON until it ends, or until Ctrl-C: first the whole state, then one line per change."""
    seen = answer_of(folder, LookAtMission(name))
    printed: Mapping[str, Any] = {}
    try:
        while True:
            if any(printed.get(key) != seen[key] for key in ("version", "state", "stopped_at")):
                emit(json.dumps(seen))
            if seen["state"] not in ACTIVE:
                return 0
            printed = seen
            time.sleep(period)
            seen = answer_of(folder, LookAtMission(name, seen["version"]))
    except KeyboardInterrupt:
        return 0


def watch(folder: RobotFolder, name: str, period: float) -> int:
    """Show a mission until it ends, or until q or Ctrl-C; without a terminal once."""
    picture = picture_from_data(answer_of(folder, ShowPicture(name)))
    seen = joined({"statuses": {}, "data": {}}, answer_of(folder, LookAtMission(name)))
    colour = has_colour(sys.stdout)
    if not is_terminal():
        emit("\n".join(lines_of(picture, seen, _WIDTH, colour=colour)))
        return 0

    def drawn(width: int, height: int) -> list[str]:
        return lines_of(picture, seen, width, colour=colour)

    with LiveScreen() as screen:
        while seen["state"] in ACTIVE:
            screen.draw(drawn)
            screen.wait(period)
            if screen.is_over:
                return 0
            before, seen = seen, joined(seen, answer_of(folder, LookAtMission(name, seen["version"])))
            if seen["edition"] != before["edition"]:
                picture = picture_from_data(answer_of(folder, ShowPicture(name)))
    emit("\n".join(lines_of(picture, seen, _WIDTH, colour=colour)))
    return 0
