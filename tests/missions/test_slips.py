"""Slips of people who know another language: each is told with its cure, and cured where it is sure."""

from __future__ import annotations

import pytest

from rbxcompose.base.findings import Report, apply_fixes, safe_fixes
from rbxcompose.commands.formats.text import render_text
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions.analysis.examined import check_program
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.slips.values import ENDLESS, FLAGS, FOREIGN, STEPS
from rbxcompose.testing.golden import Golden
from tests.loops import for_all
from tests.missions.simulated import ROBOT

FILE = "mission.yaml"
SLIPS = """\
data:
  room: dock
do:
  - go_to: dock
    retries: 3
  - go_to: dock
    while: $door
    recharge:
  - go_to: dock
    if: $door
  - go_to: dock
    sleep: 5 s
  - go_to: dock
    gentle: true
  - go_to: dock
    fly_away:
  - if: $door
    then: recharge
    otherwise: a
  - a:
    optional: yes
  - repeat: always
    every: 1 s
    do: recharge
  - go_to:kitchen
  - set:
      room: window
  - set:
      room: ketchen
  - wait_for: $battery > 20 s
"""


def report_of(text: str) -> Report:
    root, findings = read_text(text, FILE)
    report = Report(list(findings))
    program = read_program(root, report, ROBOT.skills) if isinstance(root, MappingNode) else None
    if program:
        report.extend(check_program(program, ROBOT))
    return report


def cured(text: str) -> str:
    """Return a text after all safe fixes."""
    for _ in range(5):
        text = apply_fixes(safe_fixes(report_of(text), {FILE: text}), {FILE: text}).texts.get(FILE, text)
    return text


def test_every_slip_is_told_with_its_cure(golden: Golden) -> None:
    golden.check("slips.txt", render_text(report_of(SLIPS), {FILE: SLIPS}))


@for_all(
    "wrong, right",
    [
        ("-go_to: dock\n  -say: hello", "- go_to: dock\n  - say: hello"),
        ("-recharge\n  -go_to: dock", "- recharge\n  - go_to: dock"),
        ("- go_to: dock\n  -say: hello\n  -recharge", "- go_to: dock\n  - say: hello\n  - recharge"),
        ("- go_to: dock\n  -recharge\n  - say: hi", "- go_to: dock\n  - recharge\n  - say: hi"),
        ("-go_to: dock\n  - say: hi", "- go_to: dock\n  - say: hi"),
        ("- go_to:dock\n    timeout: 5 s", "- go_to: dock\n    timeout: 5 s"),
        ("- go_to:dock", "- go_to: dock"),
        ("go_to:dock", "go_to: dock"),
        ("- go_to dock\n  - log hello\n  - wait 3 s", "- go_to: dock\n  - log: hello\n  - wait: 3 s"),
        ("- a:\n    optional: No", "- a:\n    optional: false"),
        ("repeat: endless\n  every: 1 s\n  do: a", "repeat: forever\n  every: 1 s\n  do: a"),
        ("- go_to: dock\n    recharge:", "- go_to: dock\n  - recharge:"),
        ("- go_to: dock\n    wait: 5 s", "- go_to: dock\n  - wait: 5 s"),
    ],
)
def test_a_slip_that_can_mean_one_thing_only_is_cured(wrong: str, right: str) -> None:
    assert cured(f"do:\n  {wrong}\n") == f"do:\n  {right}\n"


@for_all(
    "unclear",
    [
        "- go_to: dock\n    retries: 3",
        "- go_to: dock\n    fly_away:",
        "- [-recharge]",
        "{-recharge: 3}",
        "- -recharge",
        "go_to dock",
        "[log hello]",
        "- if $door",
        "- log [a]",
        "- go_to dock:\n    timeout: 3 s",
    ],
)
def test_what_may_mean_several_things_is_left_alone(unclear: str) -> None:
    text = f"do:\n  {unclear}\n"
    assert cured(text) == text
    assert report_of(text).has_errors


def test_a_skill_of_the_robot_is_a_step_whatever_its_value_looks_like() -> None:
    text = "do:\n  - go_to: dock\n    {}: 5 s\n"
    assert [finding.code for finding in report_of(text.format("gentle"))] == ["RBX4101"]
    assert [finding.code for finding in report_of(text.format("say"))] == ["RBX4108"]


def test_words_of_others_are_none_of_ours_and_stand_for_one_of_ours() -> None:
    settings = {"then", "else", *ROBOT.skills, *STEPS}
    for word, ours in FOREIGN.items():
        text = f"do:\n  - if: $door\n    then: a\n    {word}: $door\n"
        helps = [finding.help for finding in report_of(text) if finding.code == "RBX4101"]
        assert word not in settings
        assert any(ours in help_ for help_ in helps) or word == "if", word
    assert set(FLAGS.values()) == {"true", "false"}
    assert set(ENDLESS.values()) == {"forever"}


@pytest.mark.parametrize("key", ["timeout: 5 s", "then: recharge"])
def test_a_setting_in_the_column_of_the_dash_is_to_be_moved_right(key: str) -> None:
    (finding,) = report_of(f"do:\n  - go_to: dock\n  {key}\n")
    assert finding.help.startswith("move it right")
