"""An imported tree does what a small model of BehaviorTree.CPP does: the same starts, halts and results at all times.

The model follows the library's control and decorator nodes. No two skills of a tree end at one instant, since there the
order in which children are ticked decides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Report
from rbxcompose.commands.importing.foreign_files import ForeignFile
from rbxcompose.commands.importing.importer import ImportedFiles
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions.engine.events import SkillEnded, SkillStarted
from rbxcompose.missions.language.reader import read_program
from rbxcompose.tools.importers.bt import bt
from tests.missions.simulated import Simulated, tree

IDLE, RUNNING, SUCCESS, FAILURE = "idle", "running", "success", "failure"
TAKES = {"a": 1.0, "b": 1.371, "c": 0.613, "d": 2.237, "react": 0.319, "first": 1.729, "second": 0.883}
UNTIL = 30.0
MSEC = [97 * number + 11 for number in range(2, 40)]
Shape = Any  # None for a leaf, else a name, its attributes and the shapes of its children


@dataclass
class Clock:
    """The time, when something happens next, and what has happened."""

    fails: Mapping[str, frozenset[int]]
    now: float = 0.0
    due: list[float] = field(default_factory=list)
    story: list[str] = field(default_factory=list)
    calls: dict[str, int] = field(default_factory=dict)

    def tell(self, words: str) -> None:
        self.story.append(f"{self.now:.3f} {words}")


class ModelNode:
    """A node: `tick` returns its status, `halt` stops what runs below."""

    def __init__(self, name: str, given: Mapping[str, float], children: list[ModelNode], clock: Clock) -> None:
        self.name, self.given, self.children, self.clock = name, given, children, clock
        self.status, self.index, self.count, self.end = IDLE, 0, 0, 0.0
        self.done: dict[int, str] = {}

    def tick(self) -> str:
        self.status = getattr(self, f"tick_{self.name}")()
        return self.status

    def halt(self) -> None:
        for child in self.children:
            if child.status != IDLE:
                child.halt()
        if self.name == "Leaf" and self.status == RUNNING:
            self.clock.tell(f"{self.given['skill']} halted")
        self.index = self.index if self.name == "SequenceWithMemory" else 0
        self.status, self.count, self.end, self.done = IDLE, 0, 0.0, {}

    def over(self, status: str) -> str:
        self.halt()
        return status

    def tick_Leaf(self) -> str:  # noqa: N802 - the name of a node
        skill, clock = str(self.given["skill"]), self.clock
        if self.status != RUNNING:
            clock.calls[skill] = clock.calls.get(skill, 0) + 1
            self.end = clock.now + TAKES[skill]
            clock.due.append(self.end)
            clock.tell(skill)
        if clock.now < self.end:
            return RUNNING
        if clock.calls[skill] in clock.fails.get(skill, ()):
            clock.tell(f"{skill} failure")
            return FAILURE
        return SUCCESS

    def in_turn(self, decides: str, otherwise: str) -> str:
        while self.index < len(self.children):
            status = self.children[self.index].tick()
            if status == RUNNING:
                return RUNNING
            if status == decides:
                if self.name == "SequenceWithMemory":
                    self.children[self.index].halt()
                    return status
                return self.over(status)
            self.index += 1
        self.index = 0
        return self.over(otherwise)

    def tick_Sequence(self) -> str:  # noqa: N802
        return self.in_turn(FAILURE, SUCCESS)

    tick_SequenceWithMemory = tick_Sequence  # noqa: N815

    def tick_Fallback(self) -> str:  # noqa: N802
        return self.in_turn(SUCCESS, FAILURE)

    def tick_Parallel(self) -> str:  # noqa: N802
        many = len(self.children)
        wanted, most = (int(self.given[key]) for key in ("success_count", "failure_count"))
        wanted, most = (each if each >= 0 else many + each + 1 for each in (wanted, most))
        for index, child in enumerate(self.children):
            if index not in self.done and (status := child.tick()) != RUNNING:
                self.done[index] = status
            results = list(self.done.values())
            if results.count(SUCCESS) >= wanted:
                return self.over(SUCCESS)
            if many - results.count(FAILURE) < wanted or results.count(FAILURE) == most:
                return self.over(FAILURE)
        return RUNNING

    def tick_ParallelAll(self) -> str:  # noqa: N802
        for index, child in enumerate(self.children):
            if index not in self.done and (status := child.tick()) != RUNNING:
                self.done[index] = status
        if len(self.done) < len(self.children):
            return RUNNING
        is_failed = list(self.done.values()).count(FAILURE) >= self.given["max_failures"]
        return self.over(FAILURE if is_failed else SUCCESS)

    def tick_IfThenElse(self) -> str:  # noqa: N802
        if self.index == 0:
            status = self.children[0].tick()
            if status == RUNNING:
                return RUNNING
            self.index = 1 if status == SUCCESS else 2
            if self.index == len(self.children):
                return self.over(FAILURE)
        status = self.children[self.index].tick()
        return RUNNING if status == RUNNING else self.over(status)

    def tick_TryCatch(self) -> str:  # noqa: N802
        *tries, last = self.children
        while self.count == 0 and self.index < len(tries):
            status = tries[self.index].tick()
            if status == RUNNING:
                return RUNNING
            self.index += 1
            if status == FAILURE:
                for each in tries:
                    each.halt()
                self.count = 1
        if self.count == 0:
            return self.over(SUCCESS)
        return RUNNING if last.tick() == RUNNING else self.over(FAILURE)

    def turned(self, turned: Mapping[str, str]) -> str:
        status = self.children[0].tick()
        return RUNNING if status == RUNNING else self.over(turned[status])

    def tick_Inverter(self) -> str:  # noqa: N802
        return self.turned({SUCCESS: FAILURE, FAILURE: SUCCESS})

    def tick_ForceSuccess(self) -> str:  # noqa: N802
        return self.turned({SUCCESS: SUCCESS, FAILURE: SUCCESS})

    def tick_ForceFailure(self) -> str:  # noqa: N802
        return self.turned({SUCCESS: FAILURE, FAILURE: FAILURE})

    def again(self, on: str, key: str) -> str:
        while self.count < self.given[key]:
            status = self.children[0].tick()
            if status != on:
                return RUNNING if status == RUNNING else self.over(status)
            self.count += 1
            self.children[0].halt()
        return self.over(on)

    def tick_RetryUntilSuccessful(self) -> str:  # noqa: N802
        return self.again(FAILURE, "num_attempts")

    def tick_Repeat(self) -> str:  # noqa: N802
        return self.again(SUCCESS, "num_cycles")

    def tick_KeepRunningUntilFailure(self) -> str:  # noqa: N802
        status = self.children[0].tick()
        if status == SUCCESS:
            self.children[0].halt()
            self.clock.due.append(self.clock.now)
        return self.over(FAILURE) if status == FAILURE else RUNNING

    def tick_Timeout(self) -> str:  # noqa: N802
        if self.status != RUNNING:
            self.end = self.clock.now + self.given["msec"] / 1000
            self.clock.due.append(self.end)
        elif self.clock.now >= self.end:
            return self.over(FAILURE)
        return self.turned({SUCCESS: SUCCESS, FAILURE: FAILURE})

    def tick_Delay(self) -> str:  # noqa: N802
        if self.status != RUNNING:
            self.end = self.clock.now + self.given["delay_msec"] / 1000
            self.clock.due.append(self.end)
        if self.clock.now < self.end:
            return RUNNING
        return self.turned({SUCCESS: SUCCESS, FAILURE: FAILURE})


def _attributes(**given: list[int]) -> st.SearchStrategy[dict[str, int]]:
    return st.fixed_dictionaries({key: st.sampled_from(values) for key, values in given.items()})


def _node(inner: st.SearchStrategy[Shape]) -> st.SearchStrategy[Shape]:
    def of(names: list[str], least: int, most: int, **given: list[int]) -> st.SearchStrategy[Shape]:
        children = st.lists(inner, min_size=least, max_size=most)
        return st.tuples(st.sampled_from(names), _attributes(**given), children)

    return st.one_of(
        of(["Sequence", "SequenceWithMemory", "Fallback"], 1, 3),
        of(["Parallel"], 2, 3, success_count=[1, 2, -1, -2], failure_count=[1, 2, -1]),
        of(["ParallelAll"], 2, 3, max_failures=[1, 2]),
        of(["IfThenElse"], 2, 3),
        of(["TryCatch"], 2, 3),
        of(["Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure"], 1, 1),
        of(["RetryUntilSuccessful"], 1, 1, num_attempts=[1, 2, 3]),
        of(["Repeat"], 1, 1, num_cycles=[1, 2, 3]),
        of(["Timeout"], 1, 1, msec=MSEC),
        of(["Delay"], 1, 1, delay_msec=MSEC),
    )


SHAPES = st.recursive(st.none(), _node, max_leaves=len(TAKES))
FAILS = st.dictionaries(st.sampled_from(sorted(TAKES)), st.frozensets(st.integers(1, 3), min_size=1))


def _model(shape: Shape, skills: Iterator[str], clock: Clock) -> ModelNode:
    if shape is None:
        return ModelNode("Leaf", {"skill": next(skills)}, [], clock)  # type: ignore[dict-item]
    name, given, children = shape
    return ModelNode(name, given, [_model(child, skills, clock) for child in children], clock)


def _xml(shape: Shape, skills: Iterator[str]) -> str:
    if shape is None:
        return f"<{next(skills).capitalize()}/>"
    name, given, children = shape
    head = " ".join([name, *(f'{key}="{value}"' for key, value in given.items())])
    return f"<{head}>{''.join(_xml(child, skills) for child in children)}</{name}>"


def _modelled(shape: Shape, fails: Mapping[str, frozenset[int]]) -> tuple[str, list[str]]:
    clock = Clock(fails)
    root = _model(shape, iter(TAKES), clock)
    status = root.tick()
    while status == RUNNING and (later := [time for time in clock.due if time >= clock.now]):
        clock.now = min(later)
        if clock.now > UNTIL:
            break
        clock.due = [time for time in clock.due if time > clock.now]
        status = root.tick()
    return status, sorted(clock.story)


def _imported(shape: Shape, fails: Mapping[str, frozenset[int]]) -> tuple[str, list[str], str]:
    report = Report()
    text = f'<root BTCPP_format="4"><BehaviorTree ID="Main">{_xml(shape, iter(TAKES))}</BehaviorTree></root>'
    made = bt([ForeignFile("tried.xml", MappingNode(), text)], "tried", report)
    assert isinstance(made, ImportedFiles)
    assert not report.has_errors, list(report)
    program = read_program(tree(made.text), report)
    assert program is not None
    assert not report.has_errors, list(report)
    simulated = Simulated(program, takes=TAKES, fails=fails)
    status = simulated.advance(UNTIL)
    story = []
    for time, event in simulated.events:
        if isinstance(event, SkillStarted):
            story.append(f"{time:.3f} {event.skill}")
        elif isinstance(event, SkillEnded) and event.result != SUCCESS:
            story.append(f"{time:.3f} {event.skill} {event.result}")
    return status, sorted(story), made.text


def _durations(shape: Shape) -> Iterator[int]:
    if shape is not None:
        yield from (value for key, value in shape[1].items() if key in ("msec", "delay_msec"))
        for child in shape[2]:
            yield from _durations(child)


def _is_sure(shape: Shape) -> bool:
    """Return whether no threshold is above the number of children, and no two deadlines are the same."""
    durations = list(_durations(shape))
    return _is_possible(shape) and len(set(durations)) == len(durations)


def _is_possible(shape: Shape) -> bool:
    if shape is None:
        return True
    _, given, children = shape
    return all(abs(value) <= len(children) for key, value in given.items() if "count" in key or "fail" in key) and all(
        map(_is_possible, children)
    )


@given(SHAPES.filter(_is_sure), FAILS)
def test_a_mission_does_what_its_tree_did(shape: Shape, fails: Mapping[str, frozenset[int]]) -> None:
    status, story, text = _imported(shape, fails)
    assert (status, story) == _modelled(shape, fails), text
