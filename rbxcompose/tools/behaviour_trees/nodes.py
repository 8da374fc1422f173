"""The table of BehaviorTree.CPP's nodes: what each takes and what it is here, for import, export and docs."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.parser import parse
from rbxcompose.base.expressions.tree import ExpressionError
from rbxcompose.base.findings import Severity, kind
from rbxcompose.base.units import NUMBER, TIME
from rbxcompose.missions.program.registry import anywhere, kinds
from rbxcompose.tools.behaviour_trees.scripts import ScriptError, condition, script_of, text_of, unplaced

MISTAKE = kind("RBX2264")
NOT_SAID = kind("RBX2265")
DIFFERS = kind("RBX2266", Severity.WARNING)
CANNOT_EXPORT = kind("RBX2267")

MANY = 1_000
TWIN = "_rbx_"  # begins attributes that BehaviorTree.CPP ignores: how a mission writes the attribute that follows
BRANCH, DATA, RATE, ABOUT = "_rbx_branch", "_rbx_data", "_rbx_rate", "_description"
EXPLICIT = {"Action": (0, 0), "Condition": (0, 0), "Control": (1, MANY), "Decorator": (1, 1), "SubTree": (0, 0)}
OLD_NAMES = {  # of version 3, and names that are still accepted
    "SequenceStar": "SequenceWithMemory",
    "FallbackStar": "Fallback",
    "Selector": "Fallback",
    "RetryUntilSuccesful": "RetryUntilSuccessful",
    "SubTreePlus": "SubTree",
}
_ENTRY = re.compile(r"\s*\{\s*([^{}\s]+)\s*\}\s*")
_BOUNDARY = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|[^A-Za-z0-9]+")
MOST_MSEC = 2**31
UNNAMED = "unnamed"
NOT_IMPORTED = "not imported"


def snake(name: str) -> str:
    """Return the name of ours for a node, a tree or an entry: `GoTo` and `goTo` are `go_to`."""
    found = "_".join(part for part in _BOUNDARY.split(name) if part).lower()
    return re.sub(r"[^a-z0-9_]", "", found).lstrip("_0123456789")[:50] or UNNAMED


def skill_name(node: str) -> str:
    """Return the skill that stands for a node of a program; a word of the language gets an ending."""
    found = snake(node)
    return f"{found}_skill" if found in kinds() or found in anywhere() else found


def node_name(skill: str) -> str:
    """Return the node for a skill: `GoTo` for `go_to`, or the name as it is where that would not lead back."""
    found = "".join(part.capitalize() for part in skill.split("_"))
    return found if skill_name(found) == skill and found not in NODES and found not in EXPLICIT else skill


def entry_of(text: str, port: str) -> str:
    """Return the entry of the blackboard that the value of a port names; empty for a literal."""
    if text.strip() in ("{=}", "="):
        return port
    match = _ENTRY.fullmatch(text)
    return match[1] if match else ""


EntryNames = Callable[[str], str]
"""From the name of an entry to that of ours, or back."""


@dataclass(frozen=True, slots=True)
class PortCodec:
    """A port of a node: how its value becomes a text of ours, and back; both raise `ScriptError`."""

    read: Callable[[str, EntryNames], Any]
    write: Callable[[str], str]
    default: str | None = None


def _read_count(text: str, names: EntryNames) -> str:
    if entry := entry_of(text, ""):
        return f"${names(entry)}"
    if not re.fullmatch(r"-?\d{1,9}", text.strip()):
        raise ScriptError(f"'{text[:30]}' is not a whole number")
    count = int(text)
    if count == -1:
        return "forever"
    if count < 1:
        raise ScriptError(f"{count} is no number of times; it must be at least 1, or -1 for ever")
    return str(count)


def _write_count(text: str) -> str:
    if text in ("", "forever"):
        return "-1"
    tree = tree_of(text)
    if isinstance(tree, syntax.Variable):
        return f"{{{tree.name}}}"
    if not isinstance(tree, syntax.Number) or not tree.value.is_integer() or tree.value < 1:
        raise ScriptError("it must be a whole number of at least 1, or the name of a value")
    return str(int(tree.value))


def _read_msec(text: str, names: EntryNames) -> str:
    if entry := entry_of(text, ""):
        return f"${names(entry)} * 1 ms"
    if not re.fullmatch(r"\d{1,10}", text.strip()) or int(text) > MOST_MSEC:
        raise ScriptError(f"'{text[:30]}' is not a number of milliseconds")
    msec = int(text)
    return f"{msec} ms" if msec % 1000 else f"{msec // 1000} s"


def _write_msec(text: str) -> str:
    match tree := tree_of(text):
        case syntax.Arithmetic(operator="*", left=syntax.Variable(name=name), right=right):
            if unplaced(right) == unplaced(tree_of("1 ms")):
                return f"{{{name}}}"
        case syntax.Number(value=value, dimension=dimension) if dimension in (TIME, NUMBER):
            if abs(value * 1000 - round(value * 1000)) < 1e-6 and 0 <= value * 1000 <= MOST_MSEC:
                return str(round(value * 1000))
    raise ScriptError(f"a time must be a whole number of milliseconds, not '{text}'" if tree else "")


def tree_of(text: str) -> syntax.ExpressionNode:
    """Return the tree of an expression of ours.

    Raises:
        ScriptError: if it is none.
    """
    try:
        return parse(text).tree
    except ExpressionError as error:
        raise ScriptError(error.message) from None


COUNT, MSEC = PortCodec(_read_count, _write_count), PortCodec(_read_msec, _write_msec)
SCRIPT = PortCodec(lambda text, names: text_of(unplaced(condition(text), names)), lambda text: script_of(tree_of(text)))
TEXT = PortCodec(lambda text, names: text, str)


def _text(default: str) -> PortCodec:
    return replace(TEXT, default=default)


@dataclass(frozen=True, slots=True)
class BtNode:
    """A node: how many children it takes, its ports, and what it is here.

    `word` is the kind or the modifier that it is, with these `options`, and `port` the one that has the value of the
    word; without a word, a function of the importer reads it. With `is_exported`, the word becomes this node.
    """

    name: str
    children: tuple[int, int]
    ours: str
    note: str = ""
    ports: Mapping[str, PortCodec] = field(default_factory=dict)
    word: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    is_exported: bool = False

    @property
    def port(self) -> str:
        """Return the name of the port with the value of its word; empty if it has none."""
        return next(iter(self.ports), "")


LEAF, DECORATOR, CONTROL = (0, 0), (1, 1), (1, MANY)


def _lists() -> list[BtNode]:
    yields = "There it yields between children; here the next one starts in the same tick."
    reactive = "Earlier conditions are evaluated again at each tick, other steps are not."

    def row(name: str, word: str, note: str = "", *, is_exported: bool = True, **options: Any) -> BtNode:
        shown = "".join(f", `{key}: {str(value).lower()}`" for key, value in options.items())
        return BtNode(name, CONTROL, f"`{word}`{shown}", note, {}, word, options, is_exported)

    return [
        row("Sequence", "sequence"),
        row("ReactiveSequence", "sequence", reactive, reactive=True),
        row("SequenceWithMemory", "sequence", history="last"),
        row("AsyncSequence", "sequence", yields, is_exported=False),
        row("Fallback", "fallback"),
        row("ReactiveFallback", "fallback", reactive, reactive=True),
        row("AsyncFallback", "fallback", yields, is_exported=False),
    ]


def _modifiers() -> list[BtNode]:
    def row(name: str, word: str, shown: str, note: str = "", **ports: PortCodec) -> BtNode:
        return BtNode(name, DECORATOR, f"`{word}: {shown}`", note, ports, word, {}, is_exported=True)

    return [
        row("Inverter", "invert", "true"),
        row("ForceSuccess", "optional", "true"),
        row("RetryUntilSuccessful", "attempts", "3", "One attempt per tick; -1 is `forever`.", num_attempts=COUNT),
        row("Timeout", "timeout", "500 ms", "0 is no timeout.", msec=MSEC),
        row("RunOnce", "once", "true", "With `then_skip: false`, it would give its first result again."),
    ]


def _others() -> list[BtNode]:
    row, none = BtNode, NOT_IMPORTED
    thresholds = {"success_count": _text("-1"), "failure_count": _text("1")}
    return [
        row("Parallel", CONTROL, "`parallel`, `succeed_when: 2`, `fail_when: all`",
            "All are ticked before the result is decided, and failure beats success. A skipped one does not count.",
            thresholds),
        row("ParallelAll", CONTROL, "`parallel`, `wait_for_all: true`", "", {"max_failures": _text("1")}),
        row("IfThenElse", (2, 3), "`if`, `then`, `else`",
            "A condition that is a skill sets a datum first. Without a third child, a false condition is a failure."),
        row("WhileDoElse", (2, 3), "`as_long_as: $ready`; with three children, a reactive `sequence`",
            "The condition must be one that expressions can say."),
        *(row(f"Switch{count}", (count + 1, count + 1), "`choose: $mode`, `cases`, `else`",
              "The value is read once, at the start.",
              {"variable": TEXT, **{f"case_{number}": TEXT for number in range(1, count + 1)}})
          for count in range(2, 7)),
        row("TryCatch", (2, MANY), "`fallback` of a `sequence` and the last child, which then fails",
            "`catch_on_halt` is not imported.", {"catch_on_halt": _text("false")}),
        row("ManualSelector", CONTROL, none, "Start the mission of your choice with `rbxcompose mission run`."),
        row("ForceFailure", DECORATOR, "`optional: true`, and `invert: true` around it"),
        row("Repeat", DECORATOR, "`repeat: 3`, `do`", "One round per tick; a skipped round counts.",
            {"num_cycles": COUNT}, "repeat", {}, is_exported=True),
        row("KeepRunningUntilFailure", DECORATOR, "`repeat: forever`, `do`"),
        row("Delay", DECORATOR, "`sequence` with a `wait` before the step", "", {"delay_msec": MSEC}),
        row("Precondition", DECORATOR, "`only_if: $ready`; with another `else`: `if`", "",
            {"if": SCRIPT, "else": _text("FAILURE")}, "only_if", {}, is_exported=True),
        *(row(f"BlackboardCheck{type_}", DECORATOR, "`if: $a == $b`, `then`, `else`", "Of version 3.",
              {"value_A": TEXT, "value_B": TEXT, "return_on_mismatch": _text("FAILURE")})
          for type_ in ("Int", "Double", "Bool", "String")),
        *(row(name, DECORATOR, "`for: item`, `in: [1, 2]`, `do`", "An empty list is skipped.",
              {"queue": TEXT, "value": TEXT, "if_empty": _text("SUCCESS")})
          for name in ("LoopInt", "LoopBool", "LoopDouble", "LoopString")),
        *(row(name, children, none, "Write `wait_for: new($value)` for a value of the robot.")
          for name, children in (("WasEntryUpdated", LEAF), ("SkipUnlessUpdated", DECORATOR),
                                 ("WaitValueUpdate", DECORATOR))),
        row("RecoveryNode", (2, 2), "`repeat` with `until`, and a datum that says whether the first child has failed",
            "Of Nav2.", {"number_of_retries": _text("1")}),
        *(row(name, CONTROL, none, "Of Nav2: `go_to` of `navigation` plans again while it drives.")
          for name in ("PipelineSequence", "GoalUpdater", "PathLongerOnApproach")),
        *(row(name, DECORATOR, none, "Of Nav2: write `repeat` with `every`, in a `parallel` with the rest.")
          for name in ("RateController", "DistanceController", "SpeedController")),
        row("RoundRobin", CONTROL, none, "Of Nav2: a `fallback` with `order: random` may begin with any child."),
        row("SingleTrigger", DECORATOR, none, "Of Nav2: write `once: true`, which is skipped after the first time."),
        row("SubTree", LEAF, "`use`, `with`; outputs by `save`", "`_autoremap` passes every entry that both use."),
        row("AlwaysSuccess", LEAF, "`check: true`"),
        row("AlwaysFailure", LEAF, "`check: false`"),
        row("Sleep", LEAF, "`wait: 500 ms`", "", {"msec": MSEC}, "wait", {}, is_exported=True),
        row("ScriptCondition", LEAF, "`check: $level > 3`", "", {"code": SCRIPT}, "check", {}, is_exported=True),
        row("Script", LEAF, "`set`, one for each statement that reads what an earlier one sets", "", {"code": TEXT}),
        row("SetBlackboard", LEAF, "`set`", "", {"value": TEXT, "output_key": TEXT}),
        row("UnsetBlackboard", LEAF, none, "Data always have a value; `set` one that means none."),
        row("TestNode", LEAF, none, "Tests of missions replace skills by `mocks`."),
        row("Log", LEAF, "`log`", "A node of your program, if an exported mission logs.",
            {"message": TEXT, "level": _text("info")}),
    ]  # fmt: skip


NODES: Mapping[str, BtNode] = {row.name: row for row in (*_lists(), *_modifiers(), *_others())}

CONDITIONS: Mapping[str, tuple[str, str]] = {
    "_failureIf": ("`if`, `then: {check: false}`, `else`", ""),
    "_successIf": ("`if`, `then: {check: true}`, `else`", ""),
    "_skipIf": ("`skip_if`", ""),
    "_while": ("a reactive `sequence`", "When the condition ends, the step counts as success and not as skipped."),
    "_onSuccess": ("`on_success: {set: ...}`", ""),
    "_onFailure": ("`on_failure: {set: ...}`", ""),
    "_onHalted": ("`on_halt: {set: ...}`", ""),
    "_post": ("`on_success` and `on_failure`", ""),
}
"""Conditions before and after a node: what they are here."""


def table() -> str:
    """Return the table of nodes as the docs have it."""
    names: dict[tuple[str, str], list[str]] = {}
    for row in NODES.values():
        names.setdefault((row.ours, row.note), []).append(f"`{row.name}`")
    rows = [(", ".join(alike), *said) for said, alike in names.items()]
    rows += [(f"`{name}=`", ours, note) for name, (ours, note) in CONDITIONS.items()]
    lines = ["| BehaviorTree.CPP | here | what differs |", "| --- | --- | --- |"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])
