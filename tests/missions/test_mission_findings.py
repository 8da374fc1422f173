"""What is said of mistakes in missions: all in one run, each at its place."""

from __future__ import annotations

import re

import pytest

from rbxcompose.base.findings import KINDS, Finding, FindingKind, Report
from rbxcompose.commands.finding_pages import body_of
from rbxcompose.commands.formats.text import render_text
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions import codes
from rbxcompose.missions.analysis.examined import check_program
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.registry import kinds
from rbxcompose.testing.golden import Golden
from tests.loops import for_all
from tests.missions.simulated import ROBOT, tree

SHAPE = """\
name: shape
colour: red
rate: 0 Hz
inputs:
  rounds:
    type: cont
  low:
    type: ratio
    default: 30 s
    minimum: 10 %
  high:
    type: ratio
    default: 95 %
    max: 90 %
  mode:
    type: choice
  nothing: 3
data:
  repeat: 0
  Upper: 1
interrupts:
  low:
    when: $battery <
    do: []
    after: continue
    afterwards: restart
  none:
    do: recharge
do:
  - go_to: dock
    recharge:
  - wait: 5 s
    check: $door
  - recharge
    timeout
  - go_to dock
  - repeet: 3
    untill: $door
    do: a
  - repeat: 3
  - repeat: 2
    do: a
    until: '${args.x} > 1'
  - for: $item
    in: [a b, [c]]
    order: random
    do: a
  - if:
      check: $door
    then: a
    els: b
  - sequence: a
  - fallback: []
  - wait
  - a:
    timout: 5 s
    until: $door
  - a:
    optional: maybe
    name: twice
  - b:
    name: twice
  - c:
    name: wait
  - timeout: 5 s
  - log: hello
    level: loud
  - set: 3
"""

MEANING = """\
name: meaning
inputs:
  rounds:
    type: count
    default: 2
  battery:
    type: ratio
    default: 20 %
data:
  go_to: 1
  rounds: 3
  greeting: hello
interrupts:
  low:
    when: $battery < 30 s and $item == 1
    do: goto
do:
  - dock_robot
  - repeet: dock
  - go_to: dok
  - go_to: $plaze
  - go_to
  - go_to:
      plce: dock
      tolerance: 5 s
  - go_to:
      - dock
  - recharge: now
  - say: hello $nobody
  - wait: 30 %
  - wait_for: $battery < 0.3
  - check: $rounds
  - a:
    timeout: $battery
    only_if: $dor
  - repeat: forever
    do:
      check: $door
  - check: $door
    attempts: forever
  - for: rounds
    in: $greeting
    do: a
  - for: place
    in: [dock, corner_1, nowhere]
    do:
      check: $place == 3
  - set:
      greeting: 5
      rounds: $rounds + 1 s
      low: 3
  - pour
"""

DEEDS = """\
name: deeds
inputs:
  rounds:
    type: count
    default: 1
data:
  n: 0
outputs:
  sum: $m + 1
interrupts:
  low:
    when: $battery < 30 %
    afterwards: end
do:
  - publish: greeting
    message: hi
  - publish: greetings
    message: hi $nobody
  - publish: steering
    message:
      liner:
        x: 1
      angular:
        z: true
        w: 2
  - publish: steering
    message: 3
  - call: light
    request: {data: 5}
  - call: lamp
  - a:
    on_success:
      set: {m: 1}
      publish: greetings
      message: $who
  - parallel:
      a:
        go_to: dock
      rest: [{wait: 1 s}, recharge]
    succeed_when: 3
  - choose: $n
    cases:
      1: a
      1.0: b
      $k: c
  - look:
    save: rounds
  - machine:
      start: one
      states:
        one:
          do: {set: {n: $n + 1}}
          on_enter:
            set: {k: 1}
          next: one
  - pour
"""


def mission_findings(text: str) -> Report:
    """Return all that is said of a mission."""
    report = Report()
    program = read_program(tree(text), report, ROBOT.skills)
    if program:
        report.extend(check_program(program, ROBOT))
    return report


@pytest.mark.parametrize(("name", "text"), [("shape", SHAPE), ("meaning", MEANING), ("deeds", DEEDS)])
def test_all_mistakes_are_found_in_one_run(name: str, text: str, golden: Golden) -> None:
    report = mission_findings(text)
    rendered = "".join(render_text(one_by_one(finding), {"mission.yaml": text}) for finding in report)
    golden.check(f"{name}.txt", rendered)


def one_by_one(finding: Finding) -> Report:
    return Report([finding])


def test_a_mission_without_anything_to_do_is_no_program() -> None:
    report = Report()
    assert read_program(tree("name: idle"), report) is None
    assert [finding.code for finding in report] == [codes.MISSING.code]


def test_nodes_may_not_be_nested_too_deeply() -> None:
    deep = "do:\n" + "".join(f"{'  ' * level}- \n" for level in range(45)) + "  " * 45 + "- a\n"
    codes_found = {finding.code for finding in mission_findings(deep)}
    assert codes.TOO_DEEP.code in codes_found


MISSION_KINDS = sorted(
    kind.code for kind in vars(codes).values() if isinstance(kind, FindingKind)
)  # checks have their own


@for_all("code", MISSION_KINDS)
def test_each_docs_page_shows_what_is_found_and_how_it_is_right(code: str) -> None:
    bad, good = re.findall(r"```yaml\n(.*?)```", body_of(KINDS[code]), re.DOTALL)
    if code == codes.WRONG_INPUT.code or code == codes.TOO_DEEP.code:
        return  # they need another file, or a page of their own
    for text, is_found in ((bad, True), (good, False)):
        root, findings = read_text(text, "page.yaml")
        assert not findings or is_found
        if isinstance(root, MappingNode):
            report = Report()
            program = read_program(root, report, ROBOT.skills)
            if program:
                report.extend(check_program(program, ROBOT))
            assert (code in {finding.code for finding in report}) == is_found


ODD = (
    "do: {machine: {start: one, states: {one: {do: {parallel: {work: a, other: b}, "
    "outcomes: {odd: $work == failure, else: otherwise}}, next: {odd: finished, else: failed}}}}}"
)


@for_all(
    "text, code, message",
    [
        ("data: {stop: {stay: 5 m, to: dock}}\ndo: {wait: $stop.stay}", "RBX4106", "a time; it is a length"),
        ("do: {for: x, in: [5 m, 3 s], do: {wait: $x}}", "RBX4106", "a time; it is a length or a time"),
        ("data: {l: [5 m, 3 s]}\ndo: {for: x, in: $l, do: {wait: $x}}", "RBX4106", "it is a length or a time"),
        ("data: {l: [5 m]}\ndo: {set: {l: '[3 s]'}}", "RBX4106", "each a length; it is a list, each a time"),
        ("data: {l: [[5 m], 3]}\ndo: {for: x, in: '$l[$battery / 1 %]', do: a}", "RBX4106", "it is a list or a count"),
        ("do: {for: place, in: [dock, 5], do: {go_to: $place}}", "RBX4105", "a pose; it is a place or a count"),
        ("inputs: {l: {type: map, default: {pl: 7}}}\ndo: {go_to: $l.pl}", "RBX4105", "a pose; it is a count"),
        ("do: {wait: -5 s}", "RBX4106", "at least 0; it is -5 s"),
        ("data: {pause: -5 s}\ndo: {wait: $pause}", "RBX4106", "at least 0; it is -5 s"),
        ("do: {a: , timeout: -1 s}", "RBX4106", "at least 0; it is -1 s"),
        ("do: {a: , attempts: -2}", "RBX4106", "at least 0; it is -2"),
        (ODD, "RBX4110", "'else' belongs to conditions"),
        (ODD.replace("else: otherwise", "rest: otherwise"), "RBX4110", "there is no 'else' in it"),
    ],
)
def test_a_mistake_is_one_finding(text: str, code: str, message: str) -> None:
    (found,) = mission_findings(text)
    assert found.code == code
    assert message in found.message


def test_every_kind_says_what_it_does() -> None:
    for kind in kinds().values():
        assert (kind.__doc__ or "").strip()
