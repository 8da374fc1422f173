"""Several nodes.

`sequence`: one node after the other, until one fails.
`fallback`: one node after the other, until one succeeds.
`parallel`: several nodes at the same time.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.base.expressions.values import NotArrived, Value
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions import codes, sdk
from rbxcompose.missions.engine.world import Inner, MissionScope
from rbxcompose.missions.program.parts import ALL, ANY, CONDITIONAL, HALTED, OTHERWISE, RESULTS, Branches, OutcomeRule
from rbxcompose.missions.sdk import FAILURE, IDLE, NAMES, RUNNING, SKIPPED, SUCCESS  # looked up in every tick


class SequenceTask(sdk.InTurnTask):
    """A list that ends at the first failure."""

    __slots__ = ()
    decides = sdk.FAILURE
    is_kept_after_failure = True


@sdk.kind("sequence", SequenceTask)
class SequenceStep(sdk.InTurn):
    """Do the nodes of a list in order, until one fails.

    Example:
        do:
          sequence:                       # a bare list is one too
            - go_to: dock
            - recharge
    """

    __slots__ = ()
    decides = sdk.FAILS
    flow = sdk.NodeFlow.IN_TURN
    look = sdk.NodeLook("→")
    sentence = sdk.says("Do {in_order}")

    @property
    def goes_on_after(self) -> str:
        """Return success."""
        return "" if self.order == sdk.RANDOM else sdk.SUCCEEDS


class FallbackTask(sdk.InTurnTask):
    """A list that ends at the first success."""

    __slots__ = ()
    decides = sdk.SUCCESS


@sdk.kind("fallback", FallbackTask)
class FallbackStep(sdk.InTurn):
    """Try the nodes of a list in order, until one succeeds; skipped ones are passed over.

    Example:
        do:
          fallback:
            - check: distance($pose, dock) < 15 cm
            - go_to: dock
    """

    __slots__ = ()
    decides = sdk.SUCCEEDS
    flow = sdk.NodeFlow.FIRST
    look = sdk.NodeLook("?")
    sentence = sdk.says("Try {in_order}, until one succeeds")

    @property
    def goes_on_after(self) -> str:
        """Return failure."""
        return "" if self.order == sdk.RANDOM else sdk.FAILS

    def possibilities(
        self, node: sdk.MissionNode, nodes: tuple[sdk.MissionNode, ...], robot: sdk.RobotNames
    ) -> Iterator[sdk.Possibility]:
        """Yield each node but the first, which is always tried."""
        for index, child in enumerate(node.children[1:], 2):
            yield sdk.Possibility(nodes[child].span, f"{node.path}: alternative {index}", sdk.started(child))


class BranchResult(str):
    """The result of a branch as a text; an outcome of its own also equals the result it counts as."""

    __slots__ = ("counts_as",)
    counts_as: str

    @classmethod
    def of(cls, status: int, outcome: str) -> BranchResult:
        """Return the result of a branch; one that has not ended was halted."""
        plain = NAMES[status] if NAMES[status] in RESULTS else HALTED
        ended = cls(outcome or plain)
        ended.counts_as = plain
        return ended

    def __eq__(self, other: object) -> bool:
        return str.__eq__(self, other) or (isinstance(other, str) and str.__eq__(self.counts_as, other))

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = str.__hash__


class BranchScope(Inner):
    """The scope of the conditions of a parallel's outcomes, which adds the result of each branch."""

    def __init__(self, outer: MissionScope, ended: Mapping[str, BranchResult]) -> None:
        super().__init__(outer)
        self._ended = ended

    def variable(self, name: str, /) -> Value | NotArrived:
        """Return the result of a branch, or look the name up in the outer scope."""
        return self._ended[name] if name in self._ended else self.outer.variable(name)


def read_outcomes(reader: sdk.NodeReader, key: str) -> tuple[OutcomeRule, ...]:
    """Read the outcomes of a parallel; `otherwise` comes last and must be there."""
    value = reader.map_of(key, "a map from outcomes to conditions")
    if value is None:
        return ()
    if not reader.names:
        message = "'outcomes' needs branches with names"
        reader.add(codes.WRONG_SHAPE.at(reader.key_span(key), message, help="write the branches as a map"))
    read = []
    for index, (name, entry) in enumerate(value.entries.items()):
        is_last = index + 1 == len(value.entries)
        is_otherwise = isinstance(entry.value, ScalarNode) and entry.value.text == OTHERWISE
        if is_otherwise != is_last:
            message = "'otherwise' comes last" if is_otherwise else f"the last outcome must be '{OTHERWISE}'"
            help_text = f"add a line such as 'lost: {OTHERWISE}'"
            reader.add(codes.WRONG_SHAPE.at(entry.value.span, message, help=help_text))
        if reader.check_name(entry.key) and name in CONDITIONAL:
            message = f"'{name}' belongs to conditions, so no outcome is named so"
            reader.add(codes.WRONG_SHAPE.at(entry.key.span, message, help="choose another name, such as 'other'"))
        asked = None if is_otherwise else reader.asked_later(value, name)
        read.append(OutcomeRule(name, asked.expression if asked else None, asked))
    return tuple(read)


PLAIN = {sdk.SUCCEEDS: sdk.SUCCEEDS, sdk.FAILS: sdk.FAILS}


class ParallelTask(sdk.Task):
    """Ticks all branches that have not ended, then decides the result."""

    __slots__ = ("branches", "children", "names", "results", "runs", "waits_for_all", "wanted")
    saved = ("names", "results", "runs", "wanted")

    def __init__(self, site: sdk.Site, step: ParallelStep) -> None:
        super().__init__(site)
        self.children = site.children
        self.branches = step.branches
        self.waits_for_all = step.wait_for_all
        self.results = [IDLE] * len(self.children)
        self.names = [""] * len(self.children)  # outcomes of their own
        self.runs = [False] * len(self.children)
        self.wanted = (0, 0)  # how many must succeed, how many must fail; 0 for all

    def begin(self) -> int:
        """Start all branches; with a deep history, only those that had not ended."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            self.results = [IDLE] * len(self.children)
            self.names = [""] * len(self.children)
        self.runs = [False] * len(self.children)
        branches = self.branches
        self.wanted = (
            self._many(branches.succeed_when, "'succeed_when'"),
            self._many(branches.fail_when, "'fail_when'"),
        )
        return self.proceed()

    def proceed(self) -> int:
        """Tick every branch that has not ended, then decide the result."""
        results, runs, engine = self.results, self.runs, self.engine
        for index, child in enumerate(self.children):
            if results[index] > RUNNING:
                continue
            engine.outcome = ""
            status = child.tick() if runs[index] else child.start()
            results[index] = status
            runs[index] = status == RUNNING
            if status != RUNNING:
                self.names[index] = engine.outcome
        status = self._judge()
        if status != RUNNING:
            self.halt_below()
            self._name_outcome()
        else:
            engine.outcome = ""
        return status

    def adapted(self, state: dict[str, Any], children: sdk.MovedChildren) -> dict[str, Any]:
        """Keep what branches that are still there have come to; new ones start at the next tick."""
        found: dict[str, list[Any]] = {
            "results": [IDLE] * children.count,
            "names": [""] * children.count,
            "runs": [False] * children.count,
        }
        for before in range(len(state["results"])):
            for now in children.kept([before]):
                if now not in children.restarted:
                    for name, entries in found.items():
                        entries[now] = state[name][before]
        return {**state, **found}

    def halt_below(self) -> None:
        """Stop all branches that run."""
        for index, child in enumerate(self.children):
            if self.runs[index]:
                self.runs[index] = False
                child.halt()

    def running(self) -> tuple[sdk.Task, ...]:
        """Return the branches that run."""
        return tuple(child for child, runs in zip(self.children, self.runs, strict=True) if runs)

    def suspend(self, from_start: bool) -> bool:
        """Suspend all branches that run."""
        for index, child in enumerate(self.children):
            if self.runs[index] and child.suspend(from_start):
                self.runs[index] = False
        return False

    def restart(self, target: sdk.Target) -> bool:
        """Restart the target, if it is in a branch that runs."""
        for index, child in enumerate(self.children):
            if not self.runs[index]:
                continue
            if child.number == target.number and not target.is_round:
                self.runs[index] = False
                child.halt()
                return True
            if child.restart(target):
                return True
        return False

    def _judge(self) -> int:
        results = self.results
        open_ones = results.count(RUNNING)
        if open_ones and self.waits_for_all:
            return RUNNING
        if self.branches.ends_with:
            return results[self.branches.names.index(self.branches.ends_with)]
        failed, succeeded = results.count(FAILURE), results.count(SUCCESS)
        counted = failed + succeeded + open_ones
        if not counted:
            return SKIPPED
        to_succeed, to_fail = (many or counted for many in self.wanted)
        if failed >= to_fail or succeeded + open_ones < to_succeed:
            return FAILURE
        return SUCCESS if succeeded >= to_succeed else RUNNING

    def _name_outcome(self) -> None:
        """Set the outcome by the conditions; without any, take that of the `ends_with` branch, or the plain one."""
        branches = self.branches
        self.engine.outcome = self.names[branches.names.index(branches.ends_with)] if branches.ends_with else ""
        if not branches.outcomes:
            return
        ended = {name: BranchResult.of(self.results[i], self.names[i]) for i, name in enumerate(branches.names)}
        scope = BranchScope(self.scope, ended)
        for outcome in branches.outcomes:
            if outcome.condition is None or sdk.holds(outcome.condition, scope):
                self.engine.outcome = outcome.name
                return
        raise sdk.NodeFailed("none of its outcomes holds")

    def _many(self, written: sdk.Expression | str, what: str) -> int:
        """Return the required number of branches; 0 for all of them."""
        if isinstance(written, str):
            return 0 if written == ALL else 1
        number = self.count_of(written, what)
        if number < 1:
            raise sdk.NodeFailed(f"{what} must be at least 1")
        return number


@sdk.kind("parallel", ParallelTask)
@sdk.dataclass(frozen=True, slots=True)
class ParallelStep(sdk.Straight):
    """Do several nodes at the same time. Each tick ticks those that have not ended, then decides the result.

    Example:
        do:
          parallel:
            drive:
              go_to: corner_1
            talk:
              log: On my way
    """

    names: tuple[str, ...] = sdk.branches()
    ends_with: sdk.ScalarNode | None = sdk.branch(
        "The branch whose result is the result; failures of others do not count."
    )
    succeed_when: sdk.Expression | str = sdk.count(
        *(ALL, ANY), help="How many branches must succeed: `all`, `any` or a number.", optional=True, default=ALL
    )
    fail_when: sdk.Expression | str = sdk.count(
        *(ANY, ALL),
        help="How many branches must fail for the whole to fail: `any`, `all` or a number.",
        optional=True,
        default=ANY,
    )
    wait_for_all: bool = sdk.flag("Whether it waits for all branches to end, even when the result is decided.")
    outcomes: tuple[OutcomeRule, ...] = sdk.kept(
        sdk.Takes.OUTCOMES,
        read_outcomes,
        "a map from outcomes to conditions",
        "Of a state's body: outcome by condition over the results of the branches; the first one wins.",
        is_required=False,
        default=(),
    )

    skipped = sdk.Skipped.WITH_ALL_INSIDE
    flow = sdk.NodeFlow.OPEN
    look = sdk.NodeLook("⇉", sdk.Form.BESIDE, has_roles=True)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say what ends it."""
        if self.ends_with is not None:
            return f"At the same time, until {self.ends_with.text} ends"
        match self.succeed_when:
            case str(word):
                return "At the same time, until one succeeds" if word == ANY else "At the same time"
            case needed:
                return f"At the same time, until {sdk.spoken(needed)} of them succeed"

    def before(self, index: int) -> str:
        """Say the name of a branch."""
        return self.names[index] if index < len(self.names) else ""

    @property
    def branches(self) -> Branches:
        """Return what decides how the branches end."""
        at = self.ends_with
        name, place = (at.text, at.span) if at else ("", None)
        return Branches(self.names, self.succeed_when, self.fail_when, name, place, self.outcomes)

    @property
    def reads(self) -> frozenset[str]:
        """Return all `$names` that its outcomes read beside its branches."""
        conditions = (outcome.condition for outcome in self.outcomes if outcome.condition)
        return frozenset(name.name for condition in conditions for name in condition.names).difference(self.names)

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes by conditions, else those of the `ends_with` branch, else the plain ones."""
        branches = self.branches
        if branches.outcomes:
            return sdk.Outcomes(
                False, False, {outcome.name: PLAIN.get(outcome.name, "") for outcome in branches.outcomes}
            )
        deciding = sdk.either(map(endings.of, branches.deciding(node.children)))
        return deciding if branches.ends_with in branches.names else deciding.plain
