"""Instances of parts: names get a prefix, references follow, topics do not, arguments keep their names."""

from __future__ import annotations

from rbxcompose.domains.muxes.sections.muxes import muxes
from tests.parts.project import BATTERY, Project

PLACES = "places:\n  dock: {x: 0 m, y: 0 m}\n"


def test_components_of_an_instance_get_its_name_in_front(project: Project) -> None:
    project.check(PLACES + "include:\n  spare: ../../parts/battery.yaml\n", {"battery": BATTERY})
    assert list(project.manifest.components) == ["spare_battery", "spare_charger"]
    assert project.findings == []


def test_all_that_a_part_says_of_its_own_names_follows(project: Project) -> None:
    part = """
        components:
          go_to: {type: go_to}
          battery: {type: battery_sim, runtime: 45 s, starts_after: [go_to, base]}
          charger: {type: charger, dock: home}
        places: {home: {x: 1 m, y: 0 m}}
        values:
          level: battery.battery_level
          long: {port: battery.battery_level}
          door: {topic: door/state}
        muxes:
          cmd_vel:
            inputs:
              nav: {from: go_to, priority: 1, timeout: 1 s}
              other: {from: base.cmd, priority: 2, timeout: 1 s}
        diagnostics:
          analyzers:
            all: {match: ["*"], expected: [battery]}
            some: {match: [batt*, base]}
            deep:
              suppressed_by: some
              analyzers:
                inner: {match: [{any: [battery, base], not: {name: charger}}], suppressed_by: some}
        missions:
          tour: {file: ../missions/tour.yaml, with: {home: home, text: elsewhere}}
        """
    robot = "include:\n  left: ../../parts/all.yaml\ncomponents:\n  base: {type: diff_drive_sim}\n"
    project.check(robot, {"all": part}, files={"missions/tour.yaml": "rbx: 1\nkind: Mission\nname: t\ndo: recharge\n"})
    assert project.value("components", "left_battery", "starts_after") == ["left_go_to", "base"]
    assert project.value("components", "left_charger", "dock") == "left_home"
    assert project.value("values") == {
        "left_level": "left_battery.battery_level",
        "left_long": {"port": "left_battery.battery_level"},
        "left_door": {"topic": "door/state"},
    }
    assert project.value("muxes", "cmd_vel", "inputs", "nav", "from") == "left_go_to"
    assert project.value("muxes", "cmd_vel", "inputs", "other", "from") == "base.cmd"
    assert project.value("diagnostics", "analyzers", "left_all", "match") == ["left_*", "cmd_vel"]
    assert project.value("diagnostics", "analyzers", "left_all", "expected") == ["left_battery"]
    assert project.value("diagnostics", "analyzers", "left_some", "match") == ["left_batt*", "base"]
    deep = {"match": [{"any": ["left_battery", "base"], "not": {"name": "left_charger"}}], "suppressed_by": "left_some"}
    assert project.value("diagnostics", "analyzers", "left_deep") == {
        "suppressed_by": "left_some",
        "analyzers": {"inner": deep},
    }
    assert project.value("missions", "left_tour", "with") == {"home": "left_home", "text": "elsewhere"}
    assert project.manifest.missions["left_tour"].path == project.folder / "missions/tour.yaml"


def test_names_that_come_in_by_with_keep_their_name(project: Project) -> None:
    robot = """
        places: {dock: {x: 0 m, y: 0 m}, garage: {x: 1 m, y: 0 m}}
        include:
          spare: {part: ../../parts/battery.yaml, with: {dock: garage, runtime: 10 s}}
        """
    project.check(robot, {"battery": BATTERY + "places:\n  garage: {x: 5 m, y: 0 m}\n"})
    assert project.value("components", "spare_charger", "dock") == "garage"
    assert project.manifest.components["spare_battery"].config
    assert project.manifest.components["spare_battery"].config.model_dump()["runtime"] == 10.0


def test_arguments_are_those_of_the_file_that_names_them(project: Project) -> None:
    robot = """
        args:
          runtime: {type: time, default: 7 s}
        places: {dock: {x: 0 m, y: 0 m}}
        include:
          one: {part: ../../parts/battery.yaml, with: {runtime: "${args.runtime * 2}"}}
          two:
            part: ../../parts/battery.yaml
            with: {runtime: 9 s}
            connect: {battery_level: b, set_battery_level: c, recharge: d}
        components:
          one_battery: {warn: "${args.runtime / 14 s * 100 %}"}
        """
    project.check(robot, {"battery": BATTERY}, sets=["args.runtime=8 s"])
    runtimes = {name: project.manifest.components[f"{name}_battery"].config for name in ("one", "two")}
    assert {name: config.model_dump()["runtime"] for name, config in runtimes.items() if config} == {
        "one": 16.0,
        "two": 9.0,
    }


def test_parts_include_parts_under_the_names_of_both(project: Project) -> None:
    arm = """
        args: {wait: {type: time}}
        include:
          hand: {part: battery.yaml, with: {runtime: "${args.wait}", dock: home}}
        places: {home: {x: 1 m, y: 0 m}}
        components:
          hand_battery: {warn: 40 %}
        values: {level: hand_battery.battery_level}
        """
    project.check(
        "include:\n  arm: {part: ../../parts/arm.yaml, with: {wait: 3 s}}\n", {"arm": arm, "battery": BATTERY}
    )
    assert project.findings == [], project.text
    assert list(project.manifest.components) == ["arm_hand_battery", "arm_hand_charger"]
    assert project.value("components", "arm_hand_charger", "dock") == "arm_home"
    assert project.value("components", "arm_hand_battery", "warn") == "40 %"
    assert project.value("values", "arm_level") == "arm_hand_battery.battery_level"
    assert list(project.manifest.parts) == ["arm.hand", "arm"]
    assert project.manifest.parts["arm"].components == {"arm_hand_battery", "arm_hand_charger"}


def test_connect_gives_topics_muxes_and_inputs_other_names(project: Project) -> None:
    part = """
        components:
          base: {type: diff_drive_sim}
          go_to: {type: go_to}
          battery: {type: battery_sim, runtime: 1 h, connect: {battery_level: old}}
        values: {seen: {topic: old}}
        muxes:
          cmd_vel:
            inputs:
              nav: {from: go_to, priority: 1, timeout: 1 s}
              hand: {priority: 2, timeout: 1 s}
            locks:
              door: {priority: 3, timeout: 1 s}
        """
    robot = """
        include:
          rear:
            part: ../../parts/cart.yaml
            connect: {cmd_vel: rear_vel, cmd_vel/hand: rear_vel/stick, old: rear/level, odom: rear/odom, go_to: go_back}
        """
    project.check(robot, {"cart": part})
    assert project.value("muxes") == {
        "rear_vel": {
            "inputs": {
                "nav": {"from": "rear_go_to", "priority": 1, "timeout": "1 s"},
                "stick": {"priority": 2, "timeout": "1 s"},
            },
            "locks": {"door": {"priority": 3, "timeout": "1 s"}},
        }
    }
    assert project.value("components", "rear_base", "connect") == {"cmd_vel": "rear_vel", "odom": "rear/odom"}
    assert project.value("components", "rear_battery", "connect") == {"battery_level": "rear/level"}
    assert project.value("values", "rear_seen", "topic") == "rear/level"
    assert project.checked
    robot_ = project.checked.compilation.robot
    assert robot_
    assert {end.topic for end in robot_.components["rear_go_to"].ends} >= {"/rear_vel/nav", "/go_back"}
    assert project.findings == [], project.text


def test_inputs_that_several_parts_bring_for_one_mux_stand_together(project: Project) -> None:
    robot = """
        include:
          base: rbx:parts/base.yaml
          nav: rbx:parts/navigation.yaml
          gamepad: rbx:parts/teleop.yaml
          keyboard:
            part: rbx:parts/teleop.yaml
            with: {priority: 90}
            connect: {cmd_vel/teleop: cmd_vel/keyboard}
        muxes:
          cmd_vel:
            inputs:
              script: {priority: 5, timeout: 1 s}
        """
    project.check(robot)
    assert project.findings == [], project.text
    assert set(project.manifest.contents.of(muxes)["cmd_vel"].inputs) == {"navigation", "teleop", "keyboard", "script"}


def test_the_robot_changes_and_removes_what_a_part_brought(project: Project) -> None:
    robot = PLACES + (
        "include:\n  spare: ../../parts/battery.yaml\n"
        "components:\n  spare_battery: {runtime: 5 s}\n  spare_charger: !remove\n"
    )
    project.check(robot, {"battery": BATTERY})
    assert project.value("components") == {"spare_battery": {"type": "battery_sim", "runtime": "5 s"}}


def test_profiles_overlays_and_sets_change_what_is_given_to_a_part(project: Project) -> None:
    robot = PLACES + (
        "include:\n  spare: {part: ../../parts/battery.yaml, with: {runtime: 9 s}}\n"
        "profiles:\n  tired:\n    include:\n      spare: {with: {runtime: 5 s}}\n"
    )
    overlay = "rbx: 1\nkind: Overlay\nname: o\ninclude:\n  spare: {with: {runtime: 4 s}}\n"

    def runtime(**chosen: list[str]) -> object:
        project.check(robot, {"battery": BATTERY}, files={"o.yaml": overlay}, **chosen)  # type: ignore[arg-type]
        config = project.manifest.components["spare_battery"].config
        return config.model_dump()["runtime"] if config else None

    assert runtime() == 9.0
    assert runtime(profiles=["tired"]) == 5.0
    assert runtime(profiles=["tired"], overlays=["o.yaml"]) == 4.0
    assert runtime(overlays=["o.yaml"], sets=["include.spare.with.runtime=3 s"]) == 3.0
    assert runtime(sets=["spare_battery.runtime=2 s"]) == 2.0


def test_paths_in_a_part_and_in_an_overlay_are_relative_to_it(project: Project) -> None:
    mission = "rbx: 1\nkind: Mission\nname: tour\ndo:\n  wait: 1 s\n"
    files = {
        "parts/tour.yaml": mission,
        "layers/tour.yaml": mission,
        "layers/o.yaml": "rbx: 1\nkind: Overlay\nname: o\nmissions: {other: tour.yaml}\n",
    }
    project.check(
        "include:\n  a: ../../parts/p.yaml\n",
        {"p": "missions: {tour: tour.yaml}\n"},
        files=files,
        overlays=["layers/o.yaml"],
    )
    assert project.findings == [], project.text
    paths = {name: mission_entry.path for name, mission_entry in project.manifest.missions.items()}
    assert paths == {"a_tour": project.folder / "parts/tour.yaml", "other": project.folder / "layers/tour.yaml"}
