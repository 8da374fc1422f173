"""Mistakes in systems are findings at their places."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.testing.golden import Golden
from tests.conftest import ROOT
from tests.loops import for_all

FINE = (ROOT / "systems/patrol_two_hosts.yaml").read_text(encoding="utf-8")
ROBOT = "robots/turtlebot/robot.yaml"
SECOND = {"robots:": "robots:\n  second: {robot: ../robots/second.yaml, on: robot}"}

WRONG = {
    "RBX6100": {"on: desk": "on: dest", "battery: robot": "battery: rob"},
    "RBX6101": {"base: robot": "bas: robot"},
    "RBX6102": {"file:type: go_to": "type: go_too"},
    "RBX6104": {"{address: 10.42.0.2}": "{}", "{address: 10.42.0.1}": "{labels: [fast]}"},
    "RBX6105": {"file:command_timeout: 0.25 s": "command_timeout: 0.15 s"},
    "RBX6107": {"on: desk": "on: desk\n    link_port: 7000", "robots:": "robots:\n  second:\n    robot: "
                "../robots/turtlebot/robot.yaml\n    on: desk\n    link_port: 7000\n    place: {base: robot}"},
    "RBX6118": {"robots:": "links:\n  wifi: {between: [robot, desk], downsample: {batery_level: 1 Hz}}\nrobots:"},
    "RBX6119": {"robots:": "links:\n  wifi: {between: [robot, desk], downsample: {cmd_vel: 1 Hz}}\nrobots:"},
    "RBX6120": {"robots:": "links:\n  wifi: {between: [robot, desk], limit: 500 bit/s}\n"
                "  eth: {between: [robot, dsk]}\nrobots:"},
    "RBX6141": {"robots:": "links:\n  wifi: {between: [robot, desk], protocol: quic, "
                "priorities: {cmd_vel: low}}\nrobots:"},
    "RBX6108b": {"file:places:": "bus: {access: user}\n\nplaces:"},
    "RBX6153": {"stop_within: 0.6 s": "stop_within: 600"},
    "RBX6140": {"stop_within: 0.6 s": "stop_within: 0.5 s"},
    "RBX6108": {"file:places:": "bus: {router: tcp/10.0.0.1:7447}\n\nplaces:"},
    "RBX6123": {"on: desk": "on: desk\n    share: [odm, go_to]"},
    "RBX6124": {"new": "seen: {type: topic_monitor, topic: /turtlebot/tf, message: tf2_msgs/TFMessage, rate: 1}",
                **SECOND, "on: desk": "on: desk\n    share: [odom]"},
    "RBX6125": {"new": "own: {type: battery_sim, runtime: 1 h, connect: {battery_level: /turtlebot/battery_level}}",
                **SECOND, "on: desk": "on: desk\n    share: [battery_level]"},
    "RBX6126": {"new": "seen: {type: topic_monitor, topic: /turtlebot/odom, message: std_msgs/String, rate: 1}",
                **SECOND, "on: desk": "on: desk\n    share: [odom]"},
    "RBX6127": {"new": "seen: {type: topic_monitor, topic: /turtlebot/cmd_vel, message: geometry_msgs/Twist, rate: 1}",
                **SECOND, "{address: 10.42.0.1}": "{labels: [fast]}", "on: desk": "on: desk\n    share: [cmd_vel]"},
    "RBX6150": {"on: desk": "on: desk\n    share: [odom, go_to]"},
    "RBX6151": {"new": "seen: {type: topic_monitor, topic: /turtlebot/odom, message: nav_msgs/Odometry, rate: 1}",
                "stop_within: 0.6 s": "stop_within: 1.2 s", **SECOND,
                "on: desk": "on: desk\n    share: [odom, go_to]\n    callers: [secnd]"},
    "RBX6152": {"new": "own: {type: charger, dock: dock, reach: 9 cm, connect: {set_battery_level: "
                "/turtlebot/set_battery_level}}\nplaces: {dock: {x: 0 m, y: 0 m}}",
                **SECOND, "on: desk": "on: desk\n    share: [set_battery_level]\n    callers: [turtlebot]"},
    "RBX6126b": {"new": "seen: {type: topic_monitor, topic: /turtlebot/go_to, message: std_msgs/String, rate: 1}",
                 **SECOND, "stop_within: 0.6 s": "stop_within: 1.2 s",
                 "on: desk": "on: desk\n    share: [go_to]\n    callers: [second]"},
    "RBX6140b": {"stop_within: 0.6 s": "stop_within: 0.9 s\n    share: [go_to, odom]\n    callers: [second]", **SECOND,
                 "new": "seen: {type: topic_monitor, topic: /turtlebot/odom, message: nav_msgs/Odometry, rate: 1}"},
    "RBX6131": {"on: desk": "on: desk\n    instances: 2", "robots:": "robots:\n  turtlebot_2: "
                "{robot: ../robots/turtlebot/robot.yaml, on: desk}"},
    "RBX6145": {"robot: {address: 10.42.0.2}": "robot: {address: 10.42.0.2, optional: true}"},
    "RBX6146": {"{address: 10.42.0.1}": "{address: 10.42.0.2}"},
    "RBX1302": {"profile: linked": "profile: garden"},
    "RBX1001": {"hosts:": "hots:"},
    "RBX1001b": {"kind: System": "kind: System\nstop_within: 1 s", "on: desk": "on: desk\n    address: 10.42.0.3"},
    "RBX1002": {"robots:": "other:"},
    "RBX1003b": {"  robot: {address": "  - {name: robot, address", "  desk: {address": "  - {name: desk, address"},
    "RBX1003": {"address: 10.42.0.2": "address: [1, 2]"},
    "RBX1003c": {"address: 10.42.0.2": "address: 10.42.0.300", "address: 10.42.0.1":
                 "address: 10.42.0.1, ssh: pi@10.42.0"},
}  # fmt: skip


@for_all("code", WRONG)
def test_a_mistake_is_a_finding_at_its_place(
    code: str, golden: Golden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("robots/turtlebot", "missions"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    monkeypatch.chdir(tmp_path)
    texts = {True: (tmp_path / ROBOT).read_text(encoding="utf-8"), False: FINE}
    changes = dict(WRONG[code])
    if component := changes.pop("new", ""):
        text = f"rbx: 1\nkind: Robot\nname: second\ncomponents:\n  {component}\n"
        (tmp_path / "robots/second.yaml").write_text(text, encoding="utf-8")
    for before, after in changes.items():
        is_robot, old = before.startswith("file:"), before.removeprefix("file:")
        assert old in texts[is_robot]
        texts[is_robot] = texts[is_robot].replace(old, after)
    (tmp_path / ROBOT).write_text(texts[True], encoding="utf-8")
    (tmp_path / "systems").mkdir()
    (tmp_path / "systems/system.yaml").write_text(texts[False], encoding="utf-8")
    system = compile_system("systems/system.yaml", environment={})
    assert code[:7] in {finding.code for finding in system.report}
    golden.check(f"{code}.txt", render_text(system.report, system.sources, False))
