"""What looks like a mistake and is none."""

from __future__ import annotations

from rbxcompose.base.findings import Report
from rbxcompose.missions.analysis.examined import check_program
from rbxcompose.missions.analysis.facts import constants_of
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.program import Program
from tests.loops import for_all
from tests.missions.simulated import ROBOT, program_of, tree

TOUR = program_of("name: tour\ninputs: {rounds: {type: count, default: 1}}\ndo: {repeat: $rounds, do: a}")
MACHINE = "do: {{machine: {{start: one, states: {{one: {{do: a, next: {{success: {}, failure: two}}}}, two: {}}}}}}}"
PARALLEL = (
    "do: {{machine: {{start: one, states: {{one: {{do: {{parallel: {{work: {}, other: a}}, "
    "outcomes: {{odd: $work == {}, rest: otherwise}}}}, next: {{odd: finished, rest: failed}}}}}}}}}}"
)


def codes(text: str) -> list[str]:
    report = Report()
    program = read_program(tree(text), report, ROBOT.skills)
    assert isinstance(program, Program)
    assert not list(report)
    return [finding.code for finding in check_program(program, ROBOT)]


@for_all(
    "text",
    [
        MACHINE.format("two", "{do: b, next: {success: one, failure: two}}"),  # it has no end at all
        MACHINE.format("finished", "{do: {repeat: forever, do: {go_to: dock, optional: true}}}"),  # meant to stay there
        MACHINE.format("finished", "{do: b, next: {success: one, failure: two}}"),
        "do: {machine: {start: one, states: {one: {do: {end: success}}}}}",
        PARALLEL.format("{wait: 1 s, timeout: 2 s}", "failure"),
        PARALLEL.format("{look: {}}", "empty"),
        PARALLEL.format("{repeat: 2, do: a}", "halted"),
        "do: {repeat: 2, do: [{go_to: dock, once: true}, {go_to: kitchen, cooldown: 1 min}]}",
        "do: [{sequence: [{go_to: dock, once: true}, b], attempts: 2}]",
        "interrupts: {low: {when: $battery < 20 %, do: {go_to: dock, once: true}}}\ndo: b",
        "interrupts: {low: {when: $battery < 20 %, afterwards: restart}}\ndo: {go_to: dock, once: true}",
        "do: [{sequence: [{check: $door}, {go_to: dock, once: true}], reactive: true}]",
        "do: [{wait: 1 s, timeout: 2 s, optional: true}, a]",
        "do: [{wait_for: $door, as_long_as: $battery > 20 %, optional: true}, a]",
        "do: [{wait: 3 s, attempts: 2, attempt_timeout: 1 s}, a]",
        "do: [{go_to: dock, attempts: 2, optional: true}, a]",  # tried twice before the failure counts as success
        "do: [{wait: 1 s, invert: true, optional: true}, a]",
        "do: {fallback: [{wait: 1 s, only_if: $door}, a]}",
        "do: {fallback: [{if: $door, then: {wait: 1 s}}, a]}",
        "do: {fallback: [[{wait: 1 s, skip_if: $door}], a]}",
        "data: {n: 0}\noutputs: {n: $n}\ndo: {go_to: dock, on_success: {set: {n: $n + 1}}}",
        "data: {n: {}}\noutputs: {n: $n}\ndo: {look: {}, save: n}",
        "outputs: {level: $battery}\ndo: a",
        "data: {room: dock}\ndo: [{choose: $room, cases: {dock: a, kitchen: b}}, {set: {room: kitchen}}]",
        "do: {choose: $door, cases: {true: a, false: b}}",
        "do: {choose: $battery < 20 %, cases: {true: a}}",
        "do: {choose: $count_of_people, cases: {1: a, 2: b}}",
        "data: {left: [dock, kitchen]}\ndo: {for: room, in: $left, remove_done: true, do: {go_to: $room}}",
        "do: {publish: greetings, message: hello}",
        "data: {l: [5 m, 3 s]}\ndo: [{log: $l}, {for: x, in: $l, do: {log: $x}}, {wait: '$l[1]'}]",
        "data: {l: [dock, 3]}\ndo: [{set: {l: '$l + [kitchen]'}}, {check: 'dock in $l'}, {set: {l: '[dock, 5]'}}]",
        "data: {l: [{to: dock}, {stay: 3 s}]}\ndo: {for: x, in: $l, do: [{go_to: $x.to}, {wait: $x.stay}]}",
        "data: {r: {people: 0, ok: false}}\ndo: [{look: {}, save: r}, {check: $r.people > 5 s and $r.success}]",
        "data: {l: [dock], n: [1]}\ndo: {set: {l: '[kitchen]', n: '$n + [2.5]'}}",
        "do: {parallel: {work: {repeat: forever, do: a}, other: b}, ends_with: other}",
        "do: {parallel: {work: {repeat: forever, do: a}, other: b}, succeed_when: any}",
        "do: {parallel: [{repeat: forever, do: a}, b, c], succeed_when: 2}",
        "do: {parallel: [{repeat: forever, do: a}, {repeat: forever, do: b}]}",  # meant to go on
    ],
)
def test_nothing_is_said_of(text: str) -> None:
    assert codes(text) == []


def test_what_a_hook_sets_or_a_node_keeps_is_no_constant() -> None:
    program = program_of(
        """
        data: {a_number: 0, kept: {}, left: [dock], fixed: 3}
        do:
          - {go_to: dock, on_failure: {set: {a_number: 1}}}
          - {look: {}, save: kept}
          - {for: room, in: $left, remove_done: true, do: {go_to: $room}}
        """
    )
    assert constants_of(program, {}) == {"fixed": 3.0}


STATE = "data: {rooms: [dock, kitchen]}\nmachine: {start: one, states: {one: {do: %s, next: %s}}}"


@for_all(
    "body, fails",
    [
        ("{for: x, in: [1, 2], do: {log: $x}}", False),
        ("{for: x, in: $rooms, do: {wait: 1 s}}", False),
        ("{for: x, in: $rooms, order: nearest, do: {wait: 1 s}}", True),  # nobody may know where the robot is
        ("{for: x, in: $rooms, do: {go_to: $x}}", True),
        ("{for: x, in: $rooms, do: {go_to: $x, optional: true}}", False),
        ("[{for: x, in: $rooms, do: {wait: 1 s}}, {set: {rooms: '[]'}}]", True),  # it may be something else by then
        ("{repeat: 2, until: $door, do: {wait: 1 s}}", False),
        ("{repeat: 2, until: 1 / $battery > 2, do: {wait: 1 s}}", True),
        ("{repeat: $count_of_people, do: {wait: 1 s}}", True),
        ("{if: $door, then: {wait: 1 s}}", False),
        ("{if: 1 / $battery > 2, then: {wait: 1 s}}", True),
        ("{choose: $door, cases: {true: {wait: 1 s}}}", True),  # the door may not have been heard of
    ],
)
def test_a_failure_has_a_transition_just_where_it_can_occur(body: str, fails: bool) -> None:
    found = {}
    for leads in ("finished", "{success: finished, failure: failed}"):
        report = Report()
        program = read_program(tree(STATE % (body, leads)), report)
        assert program is not None
        report.extend(check_program(program, ROBOT))
        found[leads] = report.has_errors
    assert list(found.values()) == [fails, not fails]
