"""What a mux of a part names follows when the robot gives its topics other names."""

from __future__ import annotations

from rbxcompose.domains.muxes.sections.muxes import muxes
from tests.parts.project import Project

PICKER = """\
components:
  base: {type: diff_drive_sim}
  driver: {type: go_to}
muxes:
  cmd_vel:
    mode: select
    initial: follow
    inputs:
      by_hand: {}
      follow: {from: driver, timeout: 0.5 s}
    locks:
      pause: {topic: pause}
"""


def test_the_first_selected_input_and_the_topic_of_a_lock_follow_their_new_names(project: Project) -> None:
    robot = """\
        include:
          one:
            part: ../../parts/picker.yaml
            connect: {cmd_vel/follow: cmd_vel/first, pause: halt}
    """
    checked = project.check(robot, {"picker": PICKER})
    assert checked.codes == [], checked.text
    mux = project.manifest.contents.of(muxes)["cmd_vel"]
    assert (mux.initial, list(mux.inputs), mux.locks["pause"].topic) == ("first", ["by_hand", "first"], "halt")


def test_the_topic_that_a_mux_of_another_name_commands_follows_its_new_name(project: Project) -> None:
    robot = """\
        include:
          one:
            part: ../../parts/picker.yaml
            connect: {cmd_vel: rear/cmd_vel}
    """
    picker = PICKER.replace("  cmd_vel:\n", "  wheels:\n    topic: cmd_vel\n")
    checked = project.check(robot, {"picker": picker})
    assert checked.codes == [], checked.text
    mux = project.manifest.contents.of(muxes)["wheels"]
    assert (mux.topic, list(mux.inputs)) == ("rear/cmd_vel", ["by_hand", "follow"])
    assert project.value("components", "one_base", "connect") == {"cmd_vel": "rear/cmd_vel"}


def test_a_profile_of_the_robot_chooses_another_mode(project: Project) -> None:
    robot = """\
        include:
          one: {part: ../../parts/picker.yaml}
        profiles:
          turns:
            muxes:
              cmd_vel:
                mode: latest
                initial: !remove
                inputs:
                  by_hand: {timeout: 0.5 s, zero_releases: true}
    """
    checked = project.check(robot, {"picker": PICKER}, profiles=["turns"])
    assert checked.codes == [], checked.text
    assert project.manifest.contents.of(muxes)["cmd_vel"].works_by == "latest"
