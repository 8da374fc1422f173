"""A kind of node is one declaration: all that a mission's nodes can do follows from it, and nothing is left behind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.base.findings import Report
from rbxcompose.compiler.schema.mission import schemas_of_keys
from rbxcompose.missions import modifiers
from rbxcompose.missions.analysis.examined import check_program
from rbxcompose.missions.engine.snapshot import restore, save
from rbxcompose.missions.engine.world import Settings
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.modifiers.results import Timeout, TimeoutTask
from rbxcompose.missions.program import registry
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.outcomes import SUCCEEDS
from rbxcompose.missions.program.registry import kinds
from rbxcompose.missions.sdk import (
    ANY,
    FAILURE,
    RUNNING,
    SUCCESS,
    Advice,
    Deed,
    Endings,
    Expression,
    Loop,
    MissionNode,
    NodeFlow,
    NodeLook,
    Outcomes,
    Possibility,
    RobotNames,
    Site,
    Task,
    child,
    count,
    dataclass,
    duration,
    kind,
    modifier,
    says,
    started,
)
from rbxcompose.missions.view.picture import picture_of
from rbxcompose.tools.inspection.mission_text import mission_sentences, mission_text
from rbxcompose.tools.inspection.pages import mission_html
from rbxcompose.tools.mission_tests.coverage import Coverage, SeenWays
from rbxcompose.tools.mission_tests.explorer import ExplorationLimits, explore
from tests.missions.simulated import ROBOT, Simulated, program_of, tree

TEXT = "do: {persist: 2, gap: 1 s, do: {go_to: dock}, timeout: 1 min}"


class PersistTask(Task):
    """Tries until the body succeeds."""

    __slots__ = ("body", "due", "gap", "left", "most")
    saved = ("due", "left")
    times = fresh = ("due",)

    def __init__(self, site: Site, step: Persist) -> None:
        super().__init__(site)
        self.body, self.most, self.gap = site.children[0], step.most, step.gap
        self.left, self.due = 0, 0.0

    def begin(self) -> int:
        self.left, self.due = self.count_of(self.most, "'persist'"), self.engine.time
        return self.proceed()

    def proceed(self) -> int:
        if not self.engine.is_due(self.due):
            return RUNNING
        status = self.advance(self.body)
        if status != FAILURE:
            return status
        self.left -= 1
        if self.left < 1:
            return FAILURE
        self.due = self.engine.time + self.number_of(self.gap, "'gap'")
        self.engine.is_due(self.due)
        return RUNNING


@dataclass(frozen=True, slots=True)
class Persist(Loop):
    """Do the body until it has succeeded once."""

    most: Expression = count(least=1)
    do = child("What is done.")
    gap: Expression = duration("Time between two tries.", least=0)

    waits = True
    flow = NodeFlow.ONE_OF
    look = NodeLook("∞")
    sentence = says("Try {most} times, {gap} apart")

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        return endings.of(node.children[0]) if node.children else ANY

    def endless(self, ends: Outcomes) -> Advice | None:
        return None

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        yield Possibility(node.span, f"{node.path}: body", started(node.children[0]))


def declare() -> None:
    kind("persist", PersistTask)(Persist)


@pytest.fixture(autouse=True)
def persist() -> Iterator[None]:
    """Register the kind for one test."""
    before = dict(kinds())
    declare()
    yield
    registry.forget("persist")
    assert kinds() == before


def findings(text: str) -> list[str]:
    report = Report()
    program = read_program(tree(text), report, ROBOT.skills)
    if program:
        report.extend(check_program(program, ROBOT))
    return [finding.message for finding in report]


def test_it_is_read_with_its_options_and_those_of_any_node() -> None:
    assert findings(TEXT) == []
    assert [node.path for node in program_of(TEXT).nodes] == ["do.persist", "do.persist.go_to"]
    assert findings("do: {persist: 2, gab: 1 s, do: a}") == [
        "'gap' needs a duration, such as '5 s'",
        "unknown key 'gab' beside 'persist'",
    ]


def test_checks_ask_it() -> None:
    assert findings("do: {persist: 0, gap: 1 s, do: a}") == ["'persist' must be above zero to have an effect"]
    assert findings("do: {persist: 2, gap: 1 s, do: {wait: 1 s}, optional: true}") == [
        "'optional' changes nothing here: 'persist' cannot fail"
    ]
    assert findings("do: {persist: 2, gap: 1 s, do: {go_to: dock, once: true}}") == []  # it comes again
    assert findings("do: {persist: 2, gap: 1 s, do: a, save: x}") == ["'persist' has no result to keep"]


def test_it_runs_is_saved_and_is_restored() -> None:
    simulated = Simulated(program_of(TEXT), fails={"go_to": frozenset({1})})
    simulated.advance(1.5)
    saved = save(simulated.engine)
    restore(simulated.engine, saved)
    assert save(simulated.engine) == saved
    assert simulated.advance(10) == SUCCEEDS
    assert simulated.now == 3.0
    assert Simulated(program_of(TEXT), fails={"go_to": frozenset({1, 2})}).advance(10) == "failure"


def test_coverage_counts_its_ways() -> None:
    seen, coverage = SeenWays(), Coverage()
    simulated = Simulated(program_of(TEXT), settings=Settings(observer=seen))
    simulated.advance(10)
    for _, event in simulated.events:
        seen.receive(event)
    coverage.add(link(simulated.program, {}), ROBOT, seen.keys)
    assert "do.persist: body" in {way.text for way in coverage.taken}
    assert {way.text for way in coverage.missing} == {"do.persist.go_to: failure"}
    kept = coverage.by_robot(7.0)[""][simulated.program.name]
    assert (kept["at"], kept["tests"], kept["ways"], kept["count"]) == (7.0, 1, len(coverage.ways), 2)
    assert kept["missing"] == [{"node": 1, "text": "do.persist.go_to: failure"}]


def test_it_is_drawn() -> None:
    picture = picture_of(program_of(TEXT), ROBOT)
    assert mission_sentences(picture).splitlines()[1:] == [
        "1 Try 2 times, 1 s apart; for at most 1 min:",
        "  1.1 Go to dock",
    ]
    assert mission_text(picture).splitlines()[1:] == ["persist 2, 1 s  (timeout 1 min)", "  go_to dock"]
    assert '<i class="sign">∞</i>' in mission_html(picture)


def test_it_is_explored() -> None:
    explored = explore(program_of(TEXT), ROBOT, {}, ExplorationLimits())
    assert set(explored.ends) == {"success", "failure"}
    assert explored.found == []
    assert not explored.is_cut


def test_it_has_a_schema() -> None:
    made = schemas_of_keys(kinds()["persist"])
    assert made["persist"]["description"] == "Do the body until it has succeeded once."
    assert made["gap"]["description"] == "Time between two tries."


def test_its_keys_are_data() -> None:
    told = [(key, field.takes, field.is_required, field.least) for key, field in kinds()["persist"].fields.items()]
    assert told == [("persist", "count", True, 1), ("do", "step", True, None), ("gap", "duration", True, 0)]


class SilentTask(Task):
    """Does nothing."""

    def __init__(self, site: Site, step: Silent) -> None:
        super().__init__(site)

    def begin(self) -> int:
        return SUCCESS


class Silent(Deed):
    """Answers nothing but what its family does."""

    __slots__ = ()


def test_a_kind_that_leaves_something_unanswered_is_refused_and_a_type_error() -> None:
    with pytest.raises(TypeError, match="the kind 'silent' does not answer may_end, sentence"):
        kind("silent", SilentTask)(Silent)  # type: ignore[type-abstract]
    with pytest.raises(TypeError, match="abstract"):
        Silent()  # type: ignore[abstract]
    assert "silent" not in kinds()


class OtherTimeout(Timeout):
    """A modifier whose name is taken."""


def test_a_word_that_is_taken_is_refused() -> None:
    before = dict(kinds())
    with pytest.raises(ValueError, match=r"two kinds are named 'wait': rbxcompose.missions.kinds.steps and tests"):
        kind("wait", PersistTask)(Persist)
    assert dict(kinds()) == before
    with pytest.raises(ValueError, match=r"two modifiers are named 'timeout'"):
        modifier("timeout", TimeoutTask)(OtherTimeout)


def test_no_key_of_a_kind_is_read_by_a_modifier_too() -> None:
    taken = {(name, key) for name, found in kinds().items() for key in found.fields if key in registry.anywhere()}
    assert taken == set()


def test_each_file_of_modifiers_has_its_place_in_the_order() -> None:
    files = {path.stem for path in Path(modifiers.__path__[0]).glob("*.py")}
    assert files == {"__init__", *registry.MODULES}


def test_nothing_of_it_is_left() -> None:
    registry.forget("persist")
    assert findings("do: {persist: dock}") == ["mission '' uses a skill that the robot does not have: 'persist'"]
    declare()
