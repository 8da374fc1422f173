"""A small robot with a few missions, compiled once, and tests that are written down beside them."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, field
from pathlib import Path

from rbxcompose.commands.formats.text import render_text
from rbxcompose.tools.mission_tests.model import Trial
from rbxcompose.tools.mission_tests.reader import TrialReader
from rbxcompose.tools.mission_tests.runner import Verdict, run_trial
from tests.conftest import ROOT

MISSIONS = {
    "patrol": (ROOT / "missions/patrol.yaml").read_text(encoding="utf-8").partition("interrupts:")[2],
    "ending": """
        do: {end: failure, message: nobody came}
    """,
    "choosing": """
        data:
          seen: 0
        do:
          - if: $battery < 30 %
            then:
              log: Low battery
            else:
              set:
                seen: $seen + 1
          - choose: $door
            cases:
              true:
                go_to: corner_1
              false:
                fallback:
                  - go_to: corner_2
                  - go_to: dock
    """,
    "states": """
        machine:
          start: away
          ends:
            stranded: failure
          states:
            away:
              do:
                go_to: corner_1
                attempts: 2
              next:
                success: home
                failure: stranded
            home:
              do:
                go_to: dock
              next:
                success: finished
                failure: failed
    """,
    "patient": """
        do:
          wait_for: $door
    """,
    "spinning": """
        do:
          repeat: forever
          do:
            repeat: 10
            do:
              check: true
    """,
    "babbling": """
        do:
          repeat: forever
          do:
            log: Again
    """,
    "posed": """
        do:
          - wait_for: age($pose) < 1 s
          - check: not new($pose)
    """,
    "several": """
        data:
          none: 0
        do:
          - publish: cmd_vel/teleop
            message:
              linear:
                x: 0.1
          - publish: cmd_vel/teleop
            message:
              linear:
                x: 0.2
          - go_to: corner_1
          - name: visit
            go_to: corner_2
            only_if: $door
            save: found
          - log: This is a corner
          - set:
              none: 1 / $none
            optional: true
          - log: $found
            only_if: $none > 0
    """,
    "hearing": """
        do:
          - wait_for: $door or new($door)
          - wait_for: new($door) and age($door) < 1 s
          - log: Something came
            name: heard
    """,
    "waiting": """
        do:
          - name: call_out
            publish: cmd_vel/teleop
            message:
              linear:
                x: 0.1
          - wait_for: $door
            timeout: 20 s
            name: listen
          - log: The door is open
    """,
}
INPUTS = "inputs:\n  rounds:\n    type: count\n    default: 2\n  low:\n    type: ratio\n    default: 50 %\n\n"


@dataclass
class Trying:
    """A project in a folder; `verdict` runs the test of a text."""

    folder: Path
    reading: TrialReader = field(default_factory=lambda: TrialReader({}))

    def __post_init__(self) -> None:
        """Write the robot and its missions."""
        robot = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
        robot = robot.replace(
            "  patrol: ../../missions/patrol.yaml\n", "".join(f"  {name}: missions/{name}.yaml\n" for name in MISSIONS)
        ).replace("values:\n", "values:\n  door: {topic: door, type: flag}\n")
        (self.folder / "robot.yaml").write_text(robot, encoding="utf-8")
        (self.folder / "missions").mkdir()
        for name, text in MISSIONS.items():
            body = f"{INPUTS}interrupts:{text}" if name == "patrol" else textwrap.dedent(text)
            head = f"rbx: 1\nkind: Mission\nname: {name}\n"
            (self.folder / f"missions/{name}.yaml").write_text(head + body, encoding="utf-8")

    def read(self, text: str, mission: str = "patrol") -> tuple[Trial | None, str]:
        """Return the test of a text and its findings; the head of the file may be left out."""
        head = f"rbx: 1\nkind: Test\nname: tried\nrobot: robot.yaml\nmission: {mission}\n"
        path = self.folder / "tried.test.yaml"
        path.write_text(head + textwrap.dedent(text), encoding="utf-8")
        trial, report = self.reading.read(path)
        shown = render_text(report, self.reading.sources).replace(f"{self.folder}/", "")
        return trial, shown

    def trial(self, text: str, mission: str = "patrol") -> Trial:
        """Return the test of a text without mistakes."""
        trial, findings = self.read(text, mission)
        assert trial is not None, findings + render_text(self.reading.report, self.reading.sources)
        return trial

    def verdict(self, text: str, mission: str = "patrol") -> Verdict:
        """Run the test of a text."""
        return run_trial(self.trial(text, mission))

    def problems(self, text: str, mission: str = "patrol") -> list[str]:
        """Return what is not as a test expects it."""
        return [problem.message for problem in self.verdict(text, mission).problems]
