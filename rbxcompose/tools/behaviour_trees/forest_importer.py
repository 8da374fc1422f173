"""From trees of BehaviorTree.CPP to missions: one for each tree, with the blackboard as inputs, data and outputs."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field
from functools import cache
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.findings import FindingKind, Report, Span
from rbxcompose.base.printable import escaped, plain
from rbxcompose.commands.importing.foreign_files import FreeNames
from rbxcompose.commands.importing.importer import ImportedFiles
from rbxcompose.commands.importing.manifest_text import Row, header, place, row, section
from rbxcompose.domains.body.xml_reader import XmlElement
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions.language.grammar import LEVELS
from rbxcompose.missions.language.node_reader import NAME as _NAME
from rbxcompose.missions.program.registry import kinds, modifier_keys, modifiers
from rbxcompose.tools.behaviour_trees import nodes
from rbxcompose.tools.behaviour_trees.forest import Forest, below, ports_of, type_of
from rbxcompose.tools.behaviour_trees.nodes import CONDITIONS, DIFFERS, EXPLICIT, MISTAKE, NODES, NOT_SAID
from rbxcompose.tools.behaviour_trees.scripts import ScriptError, number, script_of, statements, text_of, unplaced

_PLAIN = re.compile(r"[$A-Za-z0-9_(][^:#\n\r\"\\&]*+")
_LARGE = re.compile(r"[\d.]*+[eE][-+]?\d++|\d{15,}+")  # what YAML takes for a number that is none of ours
_YAML_WORDS = frozenset({"true", "false", "null", "yes", "no", "on", "off"})
_BEFORE = ("_failureIf", "_successIf", "_skipIf", "_while", "if")
_AFTER = ("_onSuccess", "_onFailure", "_onHalted", "_post")
MOST_PASSED = 20_000  # entries by `_autoremap`
_HOOKS = {"on_success": ("_onSuccess", "_post"), "on_failure": ("_onFailure", "_post"), "on_halt": ("_onHalted",)}
_TYPES = {"bool": "flag", "double": "number", "float": "number", "string": "text"}
_LOOPS = {"LoopInt": "number", "LoopDouble": "number", "LoopBool": "flag", "LoopString": "text"}
_EQUALITIES = {f"BlackboardCheck{name.removeprefix('Loop')}": type_ for name, type_ in _LOOPS.items()}


class FlowText(str):
    """A value as YAML already, which an exported mission had written."""

    __slots__ = ()


_FIRST: Mapping[str, Any] = {"number": 0, "flag": False, "list": [], "text": FlowText('""')}


def flow_text(text: object, wanted: type = object) -> FlowText | None:
    """Return a text as a value if it is one line of YAML without mistakes, and of the wanted shape."""
    if not isinstance(text, str) or len(text) > 10_000 or not text.isprintable():
        return None
    root, findings = read_text(f"x: {text}", "x.yaml")
    value = root.get("x") if isinstance(root, MappingNode) else None
    is_one = not findings and isinstance(root, MappingNode) and len(root.entries) == 1 and isinstance(value, wanted)
    return FlowText(text) if is_one else None


class ImportedStep(dict[str, Any]):
    """A step as plain data, with the element that it was made from."""

    def __init__(self, entries: Mapping[str, Any], span: Span, comment: str = "") -> None:
        super().__init__(entries)
        self.span, self.comment = span, comment


@cache
def _order() -> Mapping[str, int]:
    """Return how far outside each key of a modifier takes effect; 0 is the outermost."""
    places = {name: index for index, name in enumerate(modifiers())}
    return {key: places[cls.name] for key, cls in modifier_keys().items()}


def around(step: ImportedStep, more: Mapping[str, Any]) -> ImportedStep:
    """Return a step with a modifier around it; one that would take effect further inside needs a list between."""
    order = _order()
    if min((order[key] for key in step if key in order), default=len(order)) <= max(order[key] for key in more):
        step = ImportedStep({"sequence": [step]}, step.span)
    return ImportedStep({**step, **more}, step.span, step.comment)


def condition_of(step: ImportedStep) -> str | None:
    """Return the condition that a step evaluates, if it does nothing else."""
    match {key: value for key, value in step.items() if key != "name"}:
        case {"check": text, **rest} if not rest.keys() - {"invert"}:
            return f"not {_bracketed(text)}" if "invert" in rest else text
        case {"sequence": list(steps), **rest} | {"fallback": list(steps), **rest} if not rest.keys() - {"reactive"}:
            found = [condition_of(each) for each in steps]
            word = " and " if "sequence" in step else " or "
            return None if None in found else word.join(_bracketed(each) for each in found if each)
    return None


def _bracketed(text: str) -> str:
    return text if re.fullmatch(r"\$?[\w.]+", text) else f"({text})"


def _only_asks(step: ImportedStep) -> bool:
    inner = step.get("sequence", step.get("fallback"))
    return "check" in step or "wait_for" in step or (inner is not None and all(map(_only_asks, inner)))


def _is_nothing(element: XmlElement) -> bool:
    return type_of(element) == "AlwaysSuccess" and element.attributes == {"_skipIf": "true"}


@dataclass(frozen=True, slots=True)
class _Use:
    """An entry of the blackboard where a node reads it (`r`), writes it (`w`), or does either (`?`)."""

    entry: str
    how: str
    type: str = ""


@dataclass(slots=True)
class _TreePorts:
    """What is known of a tree's entries: how they are used, in order, and which of them callers pass."""

    uses: list[_Use]
    passed: set[str] = field(default_factory=set)
    types: dict[str, str] = field(default_factory=dict)  # of what callers pass
    known: dict[str, str] = field(default_factory=dict)  # types of what the tree itself sets
    inputs: dict[str, str] = field(default_factory=dict)  # the name of the input by entry
    outputs: set[str] = field(default_factory=set)
    guessed: set[str] = field(default_factory=set)
    names: dict[str, str] = field(default_factory=dict)
    free: FreeNames = field(default_factory=FreeNames)

    def our(self, entry: str) -> str:
        """Return the name of ours for an entry."""
        if entry not in self.names:
            self.names[entry] = self.free.take(nodes.snake(entry), "entry")
        return self.names[entry]


class ForestImporter:
    """Makes a mission of each tree; trees that others use come before those."""

    def __init__(self, forest: Forest, name: str, report: Report) -> None:
        self.forest, self.report = forest, report
        self.refused: set[int] = set()  # sub-trees that are refused, such as those that lead back, by identity
        self.left = MOST_PASSED
        self.order = self._ordered()
        self.main = self._main()
        free = FreeNames()
        self.missions = {self.main: free.take(name, "imported")}
        self.missions |= {tree: free.take(nodes.snake(tree), "tree") for tree in self.order if tree != self.main}
        self.ports: dict[str, _TreePorts] = {}
        self._analyse()

    def imported(self) -> ImportedFiles:
        """Return the missions."""
        texts = {}
        for tree in reversed(self.order):  # callers first: they know the types of what they pass
            name = self.missions[tree]
            texts[f"{name}.yaml"] = _TreeImporter(self, tree).text(name)
        main = f"{self.missions[self.main]}.yaml"
        return ImportedFiles(texts.pop(main, ""), texts, file=main)

    def _subtrees(self, tree: str) -> Iterator[XmlElement]:
        return (each for each in below(self.forest.trees[tree]) if each.name in ("SubTree", "SubTreePlus"))

    def _ordered(self) -> list[str]:
        """Return all trees, each after those that it uses; note what leads in a circle."""
        done: dict[str, None] = {}
        for start in self.forest.trees:
            path: dict[str, Iterator[XmlElement]] = {} if start in done else {start: self._subtrees(start)}
            while path:
                tree, rest = next(reversed(path.items()))
                element = next(rest, None)
                if element is None:
                    done[tree] = None
                    del path[tree]
                    continue
                used = element.attributes.get("ID", "")
                if used in path:
                    self.refused.add(id(element))
                    words = f"the tree '{plain(used, 60)}' uses itself, here or through others"
                    self.report.add(MISTAKE.at(element.span, words, help="repeat with '<Repeat>'"))
                elif used in self.forest.trees and used not in done:
                    path[used] = self._subtrees(used)
        return list(done)

    def _main(self) -> str:
        trees, named = self.forest.trees, self.forest.named_main
        used = {each.attributes.get("ID", "") for tree in trees for each in self._subtrees(tree)}
        unused = [tree for tree in trees if tree not in used] or [next(iter(trees))]
        if named in trees:
            return named
        if named:
            words, place_ = f"there is no tree '{plain(named, 60)}', the main one", next(iter(trees.values())).span
            self.report.add(MISTAKE.misspelt(place_, words, named, trees, "trees"))
        found = "MainTree" if "MainTree" in unused else unused[0]
        if not named and len(unused) > 1 and found != "MainTree":
            words = f"several trees could be the main one; '{plain(found, 60)}' is taken"
            help_text = "name it: '<root main_tree_to_execute=\"...\">'"
            self.report.add(DIFFERS.at(trees[found].span, words, help=help_text))
        return found

    def _analyse(self) -> None:
        for tree in self.order:
            found = _TreePorts([])
            for word in kinds():
                found.free.take(word, word)
            leaves = (type_of(each) for each in below(self.forest.trees[tree]) if not each.children)
            for skill in {nodes.skill_name(name): None for name in leaves if name not in NODES}:
                found.free.take(skill, "skill")
            self.ports[tree] = found
        for tree in reversed(self.order):
            for element in self._subtrees(tree):
                if (used := self.ports.get(element.attributes.get("ID", ""))) and id(element) not in self.refused:
                    used.passed |= ports_of(element).keys()
                    if _is_auto(element):
                        used.passed.add("*")
        for tree in self.order:
            self._analyse_tree(tree)

    def _analyse_tree(self, tree: str) -> None:
        found, model = self.ports[tree], self.forest.models.get(tree)
        declared = {} if model is None else {port: one.direction for port, one in model.ports.items()}
        uses = [use for element in below(self.forest.trees[tree]) for use in self._uses(element)]
        names = [use.entry for use in uses]
        begins = {name: index for index, name in reversed([*enumerate(names)])}
        ends = {name: index for index, name in enumerate(names)}
        if "*" in found.passed:
            found.passed |= {name for name in names if name[0] not in "_@"}
        passed = found.passed | declared.keys()
        for index, use in enumerate(uses):
            if use.how == "?":
                is_output = begins[use.entry] == index < ends[use.entry] and use.entry not in passed
                uses[index] = use = _Use(use.entry, "w" if is_output else "r")
                found.guessed |= {use.entry} if is_output else set()
        found.uses, written = uses, {use.entry for use in uses if use.how == "w"}
        for use in sorted(uses, key=lambda use: use.how != "w"):  # what is set tells more than what is read
            if use.type:
                found.known.setdefault(use.entry, use.type)
        first: dict[str, str] = {}
        for use in uses:
            first.setdefault(use.entry, use.how)
        items = {use.entry for use in uses if use.how == "i"}
        for name in dict.fromkeys((*names, *declared)):
            direction = declared.get(name, "")
            is_in = direction in ("input", "inout") or (not direction and first.get(name) == "r" and name in passed)
            if is_in and name not in items:
                own = found.our(name)
                found.inputs[name] = found.free.take(f"{own}_in", "in") if name in written else own
            if name in written and name in passed and direction != "input":
                found.outputs.add(name)

    def _uses(self, element: XmlElement) -> Iterator[_Use]:
        kind, ports = type_of(element), ports_of(element)
        for key in _BEFORE:
            if key in element.attributes and (key[0] == "_" or kind == "Precondition"):
                yield from _script_uses(element.attributes[key])
        if kind in ("Script", "ScriptCondition"):
            yield from _script_uses(ports.pop("code", ""))
        elif kind == "SetBlackboard":
            key = ports.pop("output_key", "")
            value = ports.get("value", "")
            literal = "" if nodes.entry_of(value, "value") else _type_of_literal(value)
            yield from ((_Use(name, "r"),) if (name := nodes.entry_of(value, "value")) else ())
            if key:
                yield _Use(nodes.entry_of(key, key) or key, "w", literal)
        elif kind in _LOOPS:
            for key, how, type_ in (("queue", "r", "list"), ("value", "i", "")):
                if name := nodes.entry_of(ports.get(key, ""), key):
                    yield _Use(name, how, type_)
        elif kind == "SubTree":
            yield from self._passed_uses(element)
        else:
            model = self.forest.models.get(kind)
            hows = {"input": "r", "output": "w", "inout": "w"}
            for port, text in ports.items():
                if name := nodes.entry_of(text, port):
                    is_own = kind in NODES
                    declared = model.ports.get(port) if model is not None else None
                    how = "r" if is_own else hows[declared.direction] if declared else "?"
                    type_ = _type_of_port(declared.element.attributes) if declared else _EQUALITIES.get(kind, "")
                    yield _Use(name, how, type_)
        for key in _AFTER:
            yield from _script_uses(element.attributes.get(key, ""))

    def _passed_uses(self, element: XmlElement) -> Iterator[_Use]:
        used = self.ports.get(element.attributes.get("ID", ""))
        if used is None or id(element) in self.refused:
            return
        if _is_auto(element):
            self.left -= len(used.inputs) + len(used.outputs)
            if self.left < 0:
                words = f"'_autoremap' would pass more than {MOST_PASSED:,} entries in all trees together"
                self.report.add(MISTAKE.at(element.span, words, help="name the ports that a tree needs"))
                self.refused.add(id(element))
                return
        for port, text in passed_ports(element, used, self.forest).items():
            if name := nodes.entry_of(text, port):
                if port in used.inputs:
                    yield _Use(name, "r")
                if port in used.outputs:
                    yield _Use(name, "w", used.known.get(port, ""))


def _is_auto(element: XmlElement) -> bool:
    given = element.attributes
    return given.get("_autoremap", given.get("__shared_blackboard", "")).lower() in ("true", "1")


def passed_ports(element: XmlElement, used: _TreePorts, forest: Forest) -> dict[str, str]:
    """Return what a sub-tree is given, by port, with what its model and `_autoremap` add."""
    found = ports_of(element)
    model = forest.models.get(element.attributes.get("ID", ""))
    for port, declared in model.ports.items() if model is not None and not _is_auto(element) else ():
        default = declared.element.attributes.get("default", "")
        if nodes.entry_of(default, port):  # a literal is the default of the input
            found.setdefault(port, default)
    if _is_auto(element):
        for port in (*used.inputs, *used.outputs):
            found.setdefault(port, f"{{{port}}}")
    return found


def _script_uses(text: str) -> Iterator[_Use]:
    try:
        found = statements(text)
    except ScriptError:
        return
    for each in found:
        yield from (_Use(node.name, "r") for node, _ in syntax.walk(each.value) if isinstance(node, syntax.Variable))
        if each.to:
            yield _Use(each.to, "w", _type_of_tree(each.value))


def _type_of_port(attributes: Mapping[str, str]) -> str:
    """Return the type of ours for one of C++."""
    cpp = attributes.get("type", "").rpartition("::")[2]
    return _TYPES.get(cpp, "number" if re.search(r"\bu?int(\d+_t)?\b", cpp) else "")


def _type_of_tree(tree: syntax.ExpressionNode) -> str:
    match tree:
        case syntax.Number() | syntax.Minus():
            return "number"
        case syntax.Text():
            return "text"
        case syntax.Flag() | syntax.Not() | syntax.Comparison() | syntax.Junction():
            return "flag"
        case syntax.Arithmetic(left=left, right=right):
            return "text" if "text" in (_type_of_tree(left), _type_of_tree(right)) else "number"
    return ""


def _type_of_literal(text: str) -> str:
    return _type_of_tree(_literal(text))


def _literal(text: str, wanted: str = "") -> syntax.ExpressionNode:
    """Return a literal of a port: a number, a flag or a text, as it looks if no type is wanted."""
    word = text.strip()
    if wanted in ("", "number") and re.fullmatch(r"-?\d+(\.\d+)?([eE][-+]?\d+)?", word) and abs(float(word)) < 1e15:
        value = number(abs(float(word)))
        return syntax.Minus(0, 0, value) if word[0] == "-" else value
    if wanted in ("", "flag") and word.lower() in ("true", "false"):
        return syntax.Flag(0, 0, word.lower() == "true")
    if wanted in ("number", "flag"):
        raise ScriptError(f"'{text[:30]}' is no {wanted}")
    return syntax.Text(0, 0, text)


class _TreeImporter:
    """Makes the mission of one tree."""

    def __init__(self, forest: ForestImporter, tree: str) -> None:
        self.all, self.tree, self.report = forest, tree, forest.report
        self.root = forest.forest.trees[tree]
        self.ports = forest.ports[tree]
        self.data: dict[str, Any] = {}
        self.node_names = FreeNames()
        for word in kinds():
            self.node_names.take(word, word)
        self.is_asked = False  # whether this is evaluated again and again by the node around it
        self.told: set[str] = set()
        self.kept: set[str] = set()  # names of results

    def our(self, entry: str) -> str:
        """Return the name of ours for an entry."""
        if entry.startswith("@"):
            self.told_once("@", NOT_SAID, self.root.span,
                           f"'{plain(entry, 60)}' is shared by all trees, which data are not",
                           "pass it to each sub-tree by a port")  # fmt: skip
        return self.ports.our(entry)

    def told_once(self, key: str, code: FindingKind, span: Span, words: str, help_text: str) -> None:
        if key not in self.told:
            self.told.add(key)
            self.report.add(code.at(span, words, help=help_text))

    # the mission

    def text(self, name: str) -> str:
        """Return the text of the mission."""
        body = self.root.children[0]
        ports = self.ports
        written = dict.fromkeys(use.entry for use in ports.uses if use.how == "w")
        start = [entry for entry in ports.inputs if entry in written]
        declared: dict[str, Any] = {}
        if nodes.DATA in body.attributes and len(body.children) == 2 and type_of(body.children[0]) == "Script":
            declared, body = self.declared(body.children[0]), body.children[1]
        types = {entry: ports.known.get(entry) or ports.types.get(entry, "") for entry in written}
        first = {ports.our(entry): _FIRST.get(type_, FlowText('""')) for entry, type_ in types.items()}
        self.data = {**declared, **{name: value for name, value in first.items() if name not in declared}}
        step = self.step(body)
        if start:
            taken = {ports.our(entry): f"${ports.inputs[entry]}" for entry in start}
            step = ImportedStep({"sequence": [ImportedStep({"set": taken}, self.root.span), step]}, self.root.span)
        self.outside(types, declared)
        if _depth(step) > LEVELS:
            words = f"this tree has more than {LEVELS} levels of steps as a mission"
            self.report.add(MISTAKE.at(self.root.span, words, help="make a sub-tree of a part of it"))
        mission: dict[str, Any] = {}
        if about := self.root.attributes.get(nodes.ABOUT):
            mission["about"] = " ".join(about.split())[:200]
        mission["inputs"] = {own: self.input(entry) for entry, own in ports.inputs.items()}
        mission["data"] = self.data
        mission["outputs"] = {ports.our(entry): f"${ports.our(entry)}" for entry in sorted(ports.outputs)}
        if rate := self.root.attributes.get(nodes.RATE):
            mission["rate"] = rate
        mission["do"] = step
        rows = _written({key: value for key, value in mission.items() if value}, 0)
        return f"{header('bt', self.all.forest.files, 'Mission', name)}\n{section(rows)}"

    def declared(self, script: XmlElement) -> dict[str, Any]:
        """Return the data that an exported mission begins with."""
        try:
            found = json.loads(script.attributes.get(nodes.DATA, ""))
        except (ValueError, RecursionError):
            return {}
        texts = found.items() if isinstance(found, dict) else ()
        return {name: text for name, one in texts if _NAME.fullmatch(name) and (text := flow_text(one)) is not None}

    def input(self, entry: str) -> Any:
        """Return the declaration of an input."""
        model = self.all.forest.models.get(self.tree)
        port = model.ports.get(entry) if model is not None else None
        attributes = port.element.attributes if port is not None else {}
        if written := flow_text(attributes.get(f"{nodes.TWIN}input"), MappingNode):
            return written
        known = self.ports.types.get(entry) or self.ports.known.get(entry, "")
        type_ = _type_of_port(attributes) or known or "text"
        default = attributes.get("default", "")
        shown: dict[str, Any] = {"type": type_}
        if default and not nodes.entry_of(default, entry):
            try:
                shown["default"] = default if type_ == "text" else text_of(_literal(default, type_))
            except ScriptError as error:
                span = port.element.span if port is not None else self.root.span
                self.report.add(MISTAKE.at(span, f"the default of '{plain(entry, 60)}' is left out: {error}"))
        if port is not None and port.element.text.strip():
            shown["about"] = " ".join(port.element.text.split())[:200]
        return shown

    def outside(self, types: Mapping[str, str], declared: Mapping[str, Any]) -> None:
        """Tell which entries nothing sets, and which ports were taken for outputs."""
        known = {*types, *self.ports.inputs, *(use.entry for use in self.ports.uses if use.how == "i")}
        unknown = (use.entry for use in self.ports.uses if use.entry not in known)
        if unset := [entry for entry in unknown if self.ports.our(entry) not in declared]:
            names = {entry: self.ports.our(entry) for entry in unset}
            shown = ", ".join(
                f"'{plain(entry, 60)}'" if entry == name else f"'{plain(entry, 60)}', here '{name}'"
                for entry, name in names.items()
            )
            words = f"nothing in the tree '{plain(self.tree, 60)}' sets {shown[:200]}"
            help_text = "declare what it is under 'values' of the robot, or under 'inputs' of the mission"
            self.report.add(DIFFERS.at(self.root.span, words, help=help_text))
        if self.ports.guessed:
            shown = ", ".join(f"'{plain(name, 60)}'" for name in sorted(self.ports.guessed))
            words = f"the first node that has a port for {shown[:200]} is taken to set it"
            help_text = "declare the ports of your nodes in a '<TreeNodesModel>'"
            self.report.add(DIFFERS.at(self.root.span, words, help=help_text))

    # steps

    def step(self, element: XmlElement) -> ImportedStep:
        """Return the step for an element, with its conditions before and after."""
        found = self.core(element)
        name = nodes.snake(element.attributes.get("name", ""))
        if name != nodes.UNNAMED and found.keys().isdisjoint(("name", *_order())):
            found["name"] = self.node_names.take(name, "step")
        return self.conditioned(element, found)

    def left_out(
        self, element: XmlElement, why: str, help_text: str = "", code: FindingKind = NOT_SAID
    ) -> ImportedStep:
        """Return a step that fails, after a finding, for an element that cannot be said."""
        shown = plain(type_of(element) or element.name, 60)
        self.report.add(code.at(element.span, f"'{shown}' is left out, and fails: {why}", help=help_text))
        return ImportedStep({"check": "false"}, element.span, f"'{shown}' is left out")

    def core(self, element: XmlElement) -> ImportedStep:
        """Return the step for an element without its conditions."""
        kind = type_of(element)
        if not kind:
            return self.left_out(element, "it has no 'ID'", code=MISTAKE)
        node = NODES.get(kind)
        if node is None or (element.name in EXPLICIT and kind == "Log"):
            return self.skill(element, kind)
        if node.ours == nodes.NOT_IMPORTED:
            return self.left_out(element, "missions have nothing for it", node.note)
        least, most = node.children
        if not least <= len(element.children) <= most:
            some = f"at least {least}" if most == nodes.MANY else f"{least} to {most}"
            wanted = str(least) if least == most else some
            return self.left_out(element, f"it needs {wanted} children, and has {len(element.children)}", code=MISTAKE)
        if kind != "SubTree":
            for port in ports_of(element).keys() - node.ports.keys():
                words = f"'{kind}' has no port '{plain(port, 60)}'"
                self.report.add(MISTAKE.misspelt(element.span, words, port, node.ports, "its ports are"))
            needed = (port for port, codec in node.ports.items() if codec.default is None)
            if missing := [port for port in needed if port not in element.attributes]:
                return self.left_out(element, f"its port '{missing[0]}' has no value", code=MISTAKE)
        try:
            return self.known(element, node)
        except ScriptError as error:
            return self.left_out(element, str(error))

    def known(self, element: XmlElement, node: nodes.BtNode) -> ImportedStep:
        if reader := _READERS.get(node.name):
            return reader(self, element)
        value = self.port(element, node.port) if node.port else True
        if node.word in _order():
            return around(self.step(element.children[0]), {node.word: value})
        if node.children == nodes.CONTROL:
            steps = self.steps(element, "reactive" in node.options)
            return ImportedStep({node.word: steps, **node.options}, element.span)
        return ImportedStep({node.word: value}, element.span)

    def port(self, element: XmlElement, port: str) -> Any:
        """Return what the value of a port is here; what an exported mission had written, if that is the same."""
        codec, text = NODES[type_of(element)].ports[port], element.attributes[port]
        return self.twin(element, port, text, codec.write) or codec.read(text, self.our)

    def twin(self, element: XmlElement, attribute: str, text: str, write: Callable[[str], str]) -> str:
        if twin := element.attributes.get(f"{nodes.TWIN}{attribute.lstrip('_')}"):
            try:
                return twin if write(twin) == text else ""
            except ScriptError:
                return ""
        return ""

    def condition(self, element: XmlElement, attribute: str) -> str:
        text = element.attributes[attribute]
        codec = nodes.SCRIPT
        found: str = self.twin(element, attribute, text, codec.write) or codec.read(text, self.our)
        return found

    def steps(self, element: XmlElement, is_reactive: bool = False) -> list[ImportedStep]:
        """Return the steps for the children; a reactive node evaluates all but the last again."""
        found = []
        for child in element.children:
            asks = is_reactive and child is not element.children[-1]
            with self.asking(asks or self.is_asked):
                made = self.step(child)
            if asks and not _only_asks(made) and made.comment == "":
                words = f"'{plain(type_of(child), 60)}' is not evaluated again here when it has ended"
                help_text = "a reactive list evaluates 'check' and 'wait_for' again: make it a value of the robot"
                self.report.add(DIFFERS.at(child.span, words, help=help_text))
            found.append(made)
        return found

    @contextmanager
    def asking(self, is_asked: bool) -> Iterator[None]:
        """Make conditions of the program into checks of values in this block, or not."""
        before, self.is_asked = self.is_asked, is_asked
        yield
        self.is_asked = before

    def conditioned(self, element: XmlElement, step: ImportedStep) -> ImportedStep:
        """Return a step with the conditions that an element has before and after it."""
        given = element.attributes
        for key in given:
            is_other = key[0] != "_" or key.startswith(("_rbx_", "_description", "__", "_autoremap"))
            if not is_other and key not in CONDITIONS:
                words = f"unknown attribute '{plain(key, 60)}'"
                self.report.add(MISTAKE.misspelt(element.span, words, key, CONDITIONS))
        try:
            return self._conditioned(element, step)
        except ScriptError as error:
            return self.left_out(element, str(error))

    def _conditioned(self, element: XmlElement, step: ImportedStep) -> ImportedStep:
        given, span = element.attributes, element.span
        if "_while" in given:
            holds = self.condition(element, "_while")
            mark = ImportedStep({"check": "true", "only_if": holds}, span)
            step = ImportedStep({"sequence": [mark, around(step, {"only_if": holds})], "reactive": True}, span)
            words = "if the condition of '_while' ends, the step counts as success here, not as skipped"
            self.report.add(DIFFERS.at(span, words, help="write 'as_long_as' if it should fail then"))
        is_chosen = not given.keys().isdisjoint(("_failureIf", "_successIf"))
        skip = {"skip_if": self.condition(element, "_skipIf")} if "_skipIf" in given else {}
        if skip and is_chosen:
            step = around(step, skip)
        for key, result in (("_successIf", "true"), ("_failureIf", "false")):
            if key in given:
                then = ImportedStep({"check": result}, span)
                step = ImportedStep({"if": self.condition(element, key), "then": then, "else": step}, span)
        hooks = {hook: {"set": found} for hook, keys in _HOOKS.items() if (found := self.sets(element, keys))}
        if hooks:
            step = around(step, hooks)
        return around(step, skip) if skip and not is_chosen else step

    def sets(self, element: XmlElement, keys: Sequence[str]) -> dict[str, str]:
        found: dict[str, str] = {}
        for key in keys:
            if key in element.attributes:
                groups = self.assigned(element, key)
                if len(groups) > 1 or any(name in found for group in groups for name in group):
                    raise ScriptError(f"a later statement of '{key}' reads what an earlier one sets")
                found.update(groups[0] if groups else {})
        return found

    def assigned(self, element: XmlElement, key: str) -> list[dict[str, str]]:
        """Return what a script sets; each map is set at once, and may read what those before it have set."""
        text = element.attributes[key]
        if twin := element.attributes.get(f"{nodes.TWIN}{key.lstrip('_')}"):
            try:
                written = json.loads(twin)
                if isinstance(written, dict) and assignments_script(written) == text:
                    return [written]
            except (ValueError, ScriptError, AttributeError, TypeError):
                pass  # another program has changed it: the script counts, as for BehaviorTree.CPP
        groups: list[dict[str, str]] = []
        for each in statements(text):
            if not each.to:
                raise ScriptError("a statement of this script assigns nothing")
            tree = unplaced(each.value, self.our)
            name = self.our(each.to)
            reads = {node.name for node, _ in syntax.walk(tree) if isinstance(node, syntax.Variable)}
            if not groups or name in groups[-1] or reads & groups[-1].keys():
                groups.append({})
            groups[-1][name] = text_of(tree)
        return groups

    # nodes of programs, and sub-trees

    def skill(self, element: XmlElement, kind: str) -> ImportedStep:
        """Return the skill that stands for a node of a program."""
        model = self.all.forest.models.get(kind)
        family = element.name if element.name in EXPLICIT else model.family if model is not None else ""
        if element.children or family in ("Control", "Decorator"):
            help_text = "write what it does with the kinds of missions"
            return self.left_out(element, "it is a node of your program with children, and skills have none", help_text)
        name, ports = nodes.skill_name(kind), ports_of(element)
        if self.is_asked and not ports and family in ("", "Condition"):
            words = f"'{plain(kind, 60)}' is evaluated again and again here, as a value of the robot"
            help_text = f"declare '{name}' under 'values', of the type 'flag'"
            self.told_once(kind, DIFFERS, element.span, words, help_text)
            return ImportedStep({"check": f"${name}"}, element.span)
        arguments: dict[str, Any] = {}
        outputs: dict[str, str] = {}
        for port, text in ports.items():
            if model is not None and port not in model.ports:
                words = f"the model of '{plain(kind, 60)}' has no port '{plain(port, 60)}'"
                self.report.add(MISTAKE.misspelt(element.span, words, port, model.ports, "its ports are"))
            declared = model.ports.get(port) if model is not None else None
            direction = declared.direction if declared is not None else ""
            entry = nodes.entry_of(text, port)
            is_guess = not direction and entry in self.ports.guessed and entry not in self.told
            if entry and (direction in ("output", "inout") or is_guess):
                outputs[self.our(entry)] = nodes.snake(port)
            if entry and is_guess:
                self.told.add(entry)
            if direction != "output" and not is_guess:
                arguments[nodes.snake(port)] = f"${self.our(entry)}" if entry else text.replace("$", "$$")
        only = arguments["value"] if arguments.keys() == {"value"} else arguments or None
        return self.with_outputs(element, ImportedStep({name: only}, element.span), name, outputs, ("on_success",))

    def with_outputs(
        self, element: XmlElement, step: ImportedStep, name: str, outputs: Mapping[str, str], hooks: Sequence[str]
    ) -> ImportedStep:
        """Return a step whose result is kept, and what of it is set at its end."""
        if not outputs:
            return step
        kept = element.attributes.get(f"{nodes.TWIN}save", "")
        if kept not in self.kept:
            kept = self.ports.free.take(kept or f"{name}_result", "result")
            self.kept.add(kept)
        step = around(step, {"save": kept})
        return around(step, {hook: {"set": {to: f"${kept}.{out}" for to, out in outputs.items()}} for hook in hooks})

    def subtree(self, element: XmlElement) -> ImportedStep:
        used = element.attributes.get("ID", "")
        if not used:
            return self.left_out(element, "it has no 'ID'", code=MISTAKE)
        if used not in self.all.forest.trees:
            words = f"there is no tree '{plain(used, 60)}'"
            self.report.add(MISTAKE.misspelt(element.span, words, used, self.all.forest.trees, "trees"))
            return ImportedStep({"check": "false"}, element.span, "there is no such tree")
        if id(element) in self.all.refused:
            return ImportedStep({"check": "false"}, element.span, "this tree is left out")
        ports = self.all.ports[used]
        given: dict[str, Any] = {}
        outputs: dict[str, str] = {}
        passed = passed_ports(element, ports, self.all.forest)
        for port, text in passed.items():
            entry = nodes.entry_of(text, port)
            if port not in ports.inputs and port not in ports.outputs:
                words = f"the tree '{plain(used, 60)}' neither reads nor writes '{plain(port, 60)}'"
                self.report.add(DIFFERS.at(element.span, words, help=f"remove '{plain(port, 60)}' here"))
            if port in ports.inputs:
                own = ports.inputs[port]
                given[own] = f"${self.our(entry)}" if entry else text.replace("$", "$$")
                known = self.ports.known.get(entry) or self.ports.types.get(entry, "")
                found = known if entry else _type_of_literal(text)
                ports.types.setdefault(port, found)
            if port in ports.outputs and entry:
                outputs[self.our(entry)] = ports.our(port)
        model = self.all.forest.models.get(used)
        declared = model.ports if model else {}
        optional = {port for port, model_port in declared.items() if "default" in model_port.element.attributes}
        for port in ports.inputs.keys() - passed.keys() - optional:
            words = f"the tree '{plain(used, 60)}' needs a value for its port '{plain(port, 60)}'"
            self.report.add(MISTAKE.at(element.span, words, help=f'write {plain(port, 60)}="..." here'))
        mission = self.all.missions[used]
        step = ImportedStep({"use": mission, **({"with": given} if given else {})}, element.span)
        return self.with_outputs(element, step, mission, outputs, ("on_success", "on_failure"))

    # nodes with readers of their own

    def parallel(self, element: XmlElement) -> ImportedStep:
        many = len(element.children)
        succeed = self.threshold(element, "success_count", "-1")
        fail = self.threshold(element, "failure_count", "1")
        return self.branches(element, {} if succeed == "all" else {"succeed_when": "any" if succeed == 1 else succeed},
                             {} if fail == 1 else {"fail_when": "all" if fail in (many, "all") else fail})  # fmt: skip

    def parallel_all(self, element: XmlElement) -> ImportedStep:
        many, most = len(element.children), self.threshold(element, "max_failures", "1")
        if isinstance(most, str) and most != "all":
            raise ScriptError("'max_failures' must be a whole number")
        most = many if most == "all" else most
        if most == 1:
            return self.branches(element, {"wait_for_all": True})
        needed = many - most + 1
        fail = {"fail_when": "all" if most == many else most}
        return self.branches(element, {"succeed_when": "any" if needed == 1 else needed}, fail, {"wait_for_all": True})

    def threshold(self, element: XmlElement, port: str, default: str) -> Any:
        text, many = element.attributes.get(port, default), len(element.children)
        if nodes.entry_of(text, port):
            return nodes.COUNT.read(text, self.our)
        if not re.fullmatch(r"-?\d{1,6}", text.strip()):
            raise ScriptError(f"'{port}' must be a whole number, not '{plain(text, 30)}'")
        count = int(text)
        if count == -1:
            return "all"
        found = count if count >= 0 else many + count + 1
        if not 1 <= found <= many:
            raise ScriptError(f"'{port}' is {text}, and there are {many} children")
        return found

    def branches(self, element: XmlElement, *options: Mapping[str, Any]) -> ImportedStep:
        with self.asking(False):
            steps = [self.step(child) for child in element.children]
        names = [child.attributes.get(nodes.BRANCH, "") for child in element.children]
        is_named = all(names) and len(set(names)) == len(names) and all(nodes.snake(name) == name for name in names)
        inner = dict(zip(names, steps, strict=True)) if is_named else steps
        return ImportedStep({"parallel": inner, **{k: v for more in options for k, v in more.items()}}, element.span)

    def if_then_else(self, element: XmlElement) -> ImportedStep:
        asked, *rest = element.children
        with self.asking(False):
            condition = self.step(asked)
            branches = {"then": self.step(rest[0])}
            if len(rest) < 2:
                branches["else"] = ImportedStep({"check": "false"}, element.span)
            elif not _is_nothing(rest[1]):
                branches["else"] = self.step(rest[1])
        if text := condition_of(condition):
            return ImportedStep({"if": text, **branches}, element.span)
        name = self.ports.free.take("is_so", "is_so")
        self.data[name] = False
        hooks = {"on_success": {"set": {name: "true"}}, "on_failure": {"set": {name: "false"}}}
        condition = around(around(condition, hooks), {"optional": True})
        return ImportedStep({"sequence": [condition, ImportedStep({"if": f"${name}", **branches}, element.span)]},
                            element.span)  # fmt: skip

    def while_do_else(self, element: XmlElement) -> ImportedStep:
        with self.asking(True):
            asked = self.step(element.children[0])
        text = condition_of(asked)
        if text is None:
            raise ScriptError("its condition is evaluated at each tick, and no expression can say it")
        with self.asking(False):
            steps = [self.step(child) for child in element.children[1:]]
        if len(steps) == 1:
            return around(steps[0], {"as_long_as": text})
        mark = ImportedStep({"check": "true", "only_if": text}, element.span)
        chosen = ImportedStep({"if": text, "then": steps[0], "else": steps[1]}, element.span)
        return ImportedStep({"sequence": [mark, chosen], "reactive": True}, element.span)

    def switch(self, element: XmlElement) -> ImportedStep:
        span, entry = element.span, nodes.entry_of(element.attributes["variable"], "variable")
        with self.asking(False):
            steps = [self.step(child) for child in element.children]
        cases: dict[str, ImportedStep] = {}
        for index, step in enumerate(steps[:-1], 1):
            cases.setdefault(_case(element.attributes[f"case_{index}"]), step)
        if any(use.entry == entry and use.how == "w" for child in below(element) for use in self.all._uses(child)):
            words = f"'{plain(entry, 60)}' is read once here, though it is set inside"
            self.report.add(DIFFERS.at(span, words, help="choose again after what sets it has ended"))
        otherwise = {} if _is_nothing(element.children[-1]) else {"else": steps[-1]}
        return ImportedStep({"choose": self.operand(element, "variable"), "cases": cases, **otherwise}, span)

    def try_catch(self, element: XmlElement) -> ImportedStep:
        if element.attributes.get("catch_on_halt", "false").lower() not in ("false", "0"):
            self.report.add(DIFFERS.at(element.span, "'catch_on_halt' is not carried over: a halt runs no steps",
                                       help="'on_halt' can 'set', 'log' or 'publish'"))  # fmt: skip
        steps, span = self.steps(element), element.span
        caught = ImportedStep({"sequence": [around(steps[-1], {"optional": True})], "invert": True}, span)
        return ImportedStep({"fallback": [ImportedStep({"sequence": steps[:-1]}, span), caught]}, span)

    def force_failure(self, element: XmlElement) -> ImportedStep:
        return around(around(self.step(element.children[0]), {"optional": True}), {"invert": True})

    def run_once(self, element: XmlElement) -> ImportedStep:
        if element.attributes.get("then_skip", "true").lower() in ("false", "0"):
            words = "it is skipped after the first time, and does not give its first result again"
            self.report.add(DIFFERS.at(element.span, words, help="keep the result in the data with 'on_success'"))
        return around(self.step(element.children[0]), {"once": True})

    def timeout(self, element: XmlElement) -> ImportedStep:
        step = self.step(element.children[0])
        is_none = element.attributes["msec"].strip() == "0"
        return step if is_none else around(step, {"timeout": self.port(element, "msec")})

    def retry(self, element: XmlElement) -> ImportedStep:
        attempts, step = self.port(element, "num_attempts"), self.step(element.children[0])
        if attempts == "forever" and step.keys() == {"check"} and not step.comment:
            return ImportedStep({"wait_for": step["check"]}, element.span)
        return around(step, {"attempts": attempts})

    def recovery(self, element: XmlElement) -> ImportedStep:
        given, span = element.attributes.get("number_of_retries", "1"), element.span
        retries = nodes.COUNT.read(given, self.our)
        rounds = f"{retries} + 1" if "$" in retries else str(int(retries) + 1) if retries.isdigit() else retries
        failed = self.ports.free.take("has_failed", "has_failed")
        self.data[failed] = False
        with self.asking(False):
            tried, recovery = self.steps(element)
        hooks = {"on_success": {"set": {failed: "false"}}, "on_failure": {"set": {failed: "true"}}}
        tried = around(around(tried, hooks), {"optional": True})
        turn = ImportedStep({"sequence": [around(recovery, {"only_if": f"${failed}"}), tried]}, span)
        loop = ImportedStep({"repeat": rounds, "until": f"not ${failed}", "do": turn, "optional": True}, span)
        start, end = ImportedStep({"set": {failed: "false"}}, span), ImportedStep({"check": f"not ${failed}"}, span)
        return ImportedStep({"sequence": [start, loop, end]}, span)

    def repeat(self, element: XmlElement) -> ImportedStep:
        rounds = self.port(element, "num_cycles") if type_of(element) == "Repeat" else "forever"
        return ImportedStep({"repeat": rounds, "do": self.step(element.children[0])}, element.span)

    def delay(self, element: XmlElement) -> ImportedStep:
        waited = ImportedStep({"wait": self.port(element, "delay_msec")}, element.span)
        return ImportedStep({"sequence": [waited, self.step(element.children[0])]}, element.span)

    def precondition(self, element: XmlElement) -> ImportedStep:
        return self.guarded(element, self.condition(element, "if"), "else")

    def equality(self, element: XmlElement) -> ImportedStep:
        sides = [self.operand(element, port, _EQUALITIES[type_of(element)]) for port in ("value_A", "value_B")]
        return self.guarded(element, " == ".join(sides), "return_on_mismatch")

    def guarded(self, element: XmlElement, text: str, port: str) -> ImportedStep:
        """Return the step of a decorator with a condition; a port says how it ends if that does not hold."""
        span = element.span
        step, otherwise = self.step(element.children[0]), element.attributes.get(port, "FAILURE").strip()
        if otherwise == "SKIPPED":
            return around(step, {"only_if": text})
        if otherwise == "RUNNING":
            return ImportedStep({"sequence": [ImportedStep({"wait_for": text}, span), step]}, span)
        if otherwise not in ("SUCCESS", "FAILURE"):
            raise ScriptError(f"'{port}' cannot be '{plain(otherwise, 30)}'")
        result = ImportedStep({"check": "true" if otherwise == "SUCCESS" else "false"}, span)
        return ImportedStep({"if": text, "then": step, "else": result}, span)

    def loop(self, element: XmlElement) -> ImportedStep:
        given = element.attributes
        item, queue = nodes.entry_of(given["value"], "value"), nodes.entry_of(given["queue"], "queue")
        if not item:
            raise ScriptError("'value' must be an entry in braces")
        if (empty := given.get("if_empty", "SUCCESS").strip()) != "SUCCESS":
            raise ScriptError(f"'if_empty' is '{plain(empty, 30)}'; a 'for' succeeds at the end of its list")
        wanted = _LOOPS[type_of(element)]
        items: Any = f"${self.our(queue)}" if queue else self.items(element, wanted)
        body = {"for": self.our(item), "in": items, "do": self.step(element.children[0])}
        return ImportedStep(body, element.span)

    def items(self, element: XmlElement, wanted: str) -> list[str]:
        text = element.attributes["queue"]
        twin = element.attributes.get(f"{nodes.TWIN}queue", "")
        try:
            if twin and queue_of(found := json.loads(twin))[1] == text:
                return list(found)
        except (ValueError, ScriptError, TypeError, AttributeError):
            pass  # another program has changed it: the queue counts, as for BehaviorTree.CPP
        return [text_of(_literal(each, wanted)) for each in text.split(";")] if text else []

    def script(self, element: XmlElement) -> ImportedStep:
        groups = [ImportedStep({"set": group}, element.span) for group in self.assigned(element, "code")]
        if not groups:
            raise ScriptError("its script is empty")
        return groups[0] if len(groups) == 1 else ImportedStep({"sequence": groups}, element.span)

    def set_blackboard(self, element: XmlElement) -> ImportedStep:
        key = element.attributes["output_key"]
        text = self.operand(element, "value")
        return ImportedStep({"set": {self.our(nodes.entry_of(key, key) or key): text}}, element.span)

    def operand(self, element: XmlElement, port: str, wanted: str = "") -> str:
        """Return the value of a port as an expression; a literal is of the wanted type, or what it looks like."""
        text = element.attributes[port]
        entry = nodes.entry_of(text, port)
        return f"${self.our(entry)}" if entry else text_of(_literal(text, wanted))

    def log(self, element: XmlElement) -> ImportedStep:
        level = element.attributes.get("level", "info")
        more = {} if level == "info" else {"level": level}
        return ImportedStep({"log": element.attributes["message"], **more}, element.span)

    def always(self, element: XmlElement) -> ImportedStep:
        return ImportedStep({"check": "true" if type_of(element) == "AlwaysSuccess" else "false"}, element.span)


def _case(text: str) -> str:
    tree = _literal(text)
    return text if re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", text) else text_of(tree)


def assignments_script(assigned: Mapping[str, str]) -> str:
    """Return the script that sets these names to the values of these expressions."""
    return "; ".join(f"{name} := {script_of(nodes.tree_of(text))}" for name, text in assigned.items())


def queue_of(items: Sequence[str]) -> tuple[str, str]:
    """Return the loop for a list of expressions, and its queue.

    Raises:
        ScriptError: if they are not all literals of one type without a semicolon.
    """
    trees = [nodes.tree_of(item) for item in items]
    texts = [str(tree.value if isinstance(tree, syntax.Text) else tree.name)
             for tree in trees if isinstance(tree, syntax.Text | syntax.Word)]  # fmt: skip
    if trees and len(texts) == len(trees) and not any(";" in text or not text for text in texts):
        return "LoopString", ";".join(texts)
    if trees and {_type_of_tree(tree) for tree in trees} in ({"number"}, {"flag"}):
        name = "LoopBool" if _type_of_tree(trees[0]) == "flag" else "LoopDouble"
        return name, ";".join(map(script_of, trees))
    raise ScriptError("the items of a loop must be numbers, texts or flags, all of one type")


def _depth(step: Any) -> int:
    if isinstance(step, list):
        return max(map(_depth, step), default=0)
    if isinstance(step, dict):
        return isinstance(step, ImportedStep) + max(map(_depth, step.values()), default=0)
    return 0


def _scalar(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, FlowText):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return text_of(number(float(value)))
    text = str(value)
    is_word = text.lower() in _YAML_WORDS - {"true", "false"}
    is_plain = _PLAIN.fullmatch(text) and not _LARGE.fullmatch(text) and text == text.strip() and not is_word
    return text if is_plain else escaped(json.dumps(text, ensure_ascii=False))


def _written(value: Mapping[str, Any], depth: int) -> Iterator[Row]:
    """Yield the lines of a map."""
    comment = ""
    if isinstance(value, ImportedStep):
        comment = place(value.span) + (f": {value.comment}" if value.comment else "")
    for key, inner in value.items():
        head = f"{_scalar(key)}:"
        if isinstance(inner, list) and not any(isinstance(item, dict | list) for item in inner):
            yield row(depth, f"{head} [{', '.join(map(_flow, inner))}]", comment)
        elif isinstance(inner, ImportedStep) and _is_word(inner):
            yield row(depth, f"{head} {next(iter(inner))}", comment or place(inner.span))
        elif isinstance(inner, dict):
            yield row(depth, head if inner else f"{head} {{}}", comment)
            yield from _written(inner, depth + 1)
        elif isinstance(inner, list):
            yield row(depth, head, comment)
            for item in inner:
                yield from _item(item, depth + 1)
        else:
            yield row(depth, f"{head} {_scalar(inner)}".rstrip(), comment)
        comment = ""


def _item(item: Any, depth: int) -> Iterator[Row]:
    if isinstance(item, ImportedStep) and _is_word(item):
        yield row(depth, f"- {next(iter(item))}", place(item.span))
    elif isinstance(item, dict):
        rows = _written(item, depth + 1)
        first = next(rows)
        yield row(depth, f"- {first.text.strip()}", first.comment)
        yield from rows
    else:
        yield row(depth, f"- {_scalar(item)}")


def _is_word(step: ImportedStep) -> bool:
    return len(step) == 1 and next(iter(step.values())) is None


def _flow(value: Any) -> str:
    text = _scalar(value)
    return escaped(json.dumps(text, ensure_ascii=False)) if text[:1] != '"' and re.search(r"[\[\]{},]", text) else text


_READERS: Mapping[str, Callable[[_TreeImporter, XmlElement], ImportedStep]] = {
    "Parallel": _TreeImporter.parallel,
    "ParallelAll": _TreeImporter.parallel_all,
    "IfThenElse": _TreeImporter.if_then_else,
    "WhileDoElse": _TreeImporter.while_do_else,
    **{f"Switch{count}": _TreeImporter.switch for count in range(2, 7)},
    "TryCatch": _TreeImporter.try_catch,
    "ForceFailure": _TreeImporter.force_failure,
    "RunOnce": _TreeImporter.run_once,
    "Timeout": _TreeImporter.timeout,
    "RetryUntilSuccessful": _TreeImporter.retry,
    "RecoveryNode": _TreeImporter.recovery,
    "Repeat": _TreeImporter.repeat,
    "KeepRunningUntilFailure": _TreeImporter.repeat,
    "Delay": _TreeImporter.delay,
    "Precondition": _TreeImporter.precondition,
    **dict.fromkeys(_EQUALITIES, _TreeImporter.equality),
    **dict.fromkeys(_LOOPS, _TreeImporter.loop),
    "SubTree": _TreeImporter.subtree,
    "AlwaysSuccess": _TreeImporter.always,
    "AlwaysFailure": _TreeImporter.always,
    "Script": _TreeImporter.script,
    "SetBlackboard": _TreeImporter.set_blackboard,
    "Log": _TreeImporter.log,
}
