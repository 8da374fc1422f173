"""`scene watch`: the goals and plans of arms, and the scene, as they change."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.place import place_of
from rbxcompose.cli.output.console import tell
from rbxcompose.cli.robots.lookup import NO_ANSWER, NotDoneError, known_state
from rbxcompose.cli.robots.window_views import WindowViews
from rbxcompose.printable import plain
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.scene_requests import ARM
from rbxcompose.scene_view import ARM_WINDOW, SCENE_WINDOW

_LONGEST = 300  # letters of a goal or a reason


def watch(folder: RobotFolder, *, as_json: bool) -> int:
    """Print a line for each change until Ctrl-C; as JSON all that is known then, with its `window`."""
    if (state := known_state(folder)) is None:
        raise NotDoneError(NO_ANSWER.at(None, "the robot does not tell which arms it has"))
    arms = [one.name for one in state.components if one.type == ARM]

    def changed(path: str, seen: Mapping[str, Any]) -> None:
        tell(json.dumps({"window": path, **seen}) if as_json else line_of(seen))

    with Guest(place_of(folder)) as guest, guest.interruptible():
        paths = (SCENE_WINDOW, *(f"{ARM_WINDOW}/{name}" for name in arms))
        WindowViews(guest, state.robot, paths, changed)
        guest.run(lambda: guest.is_interrupted)
    return 0


def line_of(seen: Mapping[str, Any]) -> str:
    """Return what is known of an arm or the scene, in a line."""
    problem = f"; nothing is planned: {seen['problem']}" if seen["problem"] else ""
    if "arm" not in seen:
        names = [key.partition(" ")[2] for key in seen if key.startswith("object ")]
        return plain(f"scene: {', '.join(names) or 'empty'}{problem}", _LONGEST)
    if seen["goal"]:
        way = f", {seen['duration']:.1f} s" if seen["duration"] and seen["state"] != "planning" else ""
        return plain(f"{seen['arm']}: {seen['state']}, {seen['goal']}{way}{problem}", _LONGEST)
    ended = f", {seen['outcome']}" if seen["outcome"] else ""
    return plain(f"{seen['arm']}: {seen['state']}{ended}{': ' if seen['message'] else ''}{seen['message']}", _LONGEST)
