"""Missions as trees of BehaviorTree.CPP: one for each mission, and models of the nodes that a program must have."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from dataclasses import field
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.tree import ExpressionError
from rbxcompose.base.findings import Report, Span
from rbxcompose.base.printable import plain
from rbxcompose.domains.body.xml_reader import quoted
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.reader import read_file
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.language.grammar import long_form
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.parts import expression_of
from rbxcompose.missions.program.registry import anywhere, kinds
from rbxcompose.tools.behaviour_trees import nodes
from rbxcompose.tools.behaviour_trees.forest_importer import assignments_script, queue_of
from rbxcompose.tools.behaviour_trees.nodes import CANNOT_EXPORT, NODES, TWIN
from rbxcompose.tools.behaviour_trees.scripts import ScriptError, condition, script_of, statements, text_of, unplaced

_HELP = "write it with what BehaviorTree.CPP has, or keep this mission here"
_ATTRIBUTES = {"on_success": "_onSuccess", "on_failure": "_onFailure", "on_halt": "_onHalted"}


@dataclass(slots=True)
class MadeElement:
    """An element of XML to be written."""

    name: str
    attributes: dict[str, str] = field(default_factory=dict)
    children: list[MadeElement] = field(default_factory=list)

    def lines(self, depth: int = 0) -> Iterator[str]:
        """Yield its lines."""
        head = "  " * depth + " ".join(
            [f"<{self.name}", *(f"{key}={quoted(text)}" for key, text in self.attributes.items())]
        )
        if not self.children:
            yield f"{head}/>"
            return
        yield f"{head}>"
        for child in self.children:
            yield from child.lines(depth + 1)
        yield f"{'  ' * depth}</{self.name}>"


def exported(path: Path, report: Report, sources: MutableMapping[str, str]) -> dict[str, str]:
    """Return the file for a mission and those that it uses, which are beside it, by its name; with errors, nothing."""
    missions: dict[str, MappingNode] = {}
    waiting = [(path.stem, path)]
    while waiting:
        name, file = waiting.pop()
        root = _read(file, report, sources)
        if root is None:
            continue
        missions[name] = root
        program = read_program(root, report)
        for used in (node.step.uses for node in program.nodes if node.step.uses) if program is not None else ():
            found = file.with_name(f"{used.text}.yaml")
            if not found.is_file():
                words = f"the mission '{plain(used.text, 60)}' is not beside this one"
                report.add(CANNOT_EXPORT.at(used.span, words, help=f"put its file there, as '{found.name}'"))
            elif used.text not in missions and used.text not in [name for name, _ in waiting]:
                waiting.append((used.text, found))
    if report.has_errors:
        return {}
    text = xml_of(missions, path.stem, report)
    return {} if report.has_errors else {f"{path.stem}.xml": text}


def _read(path: Path, report: Report, sources: MutableMapping[str, str]) -> MappingNode | None:
    root, findings = read_file(path, shown_name(path), sources)
    report.extend(findings)
    if isinstance(root, MappingNode):
        said = root.get("kind")
        if isinstance(said, ScalarNode) and said.text != "Mission":
            report.add(CANNOT_EXPORT.at(said.span, "only a mission is a tree", help="name the file of a mission"))
            return None
        return root
    return None


def xml_of(missions: Mapping[str, MappingNode], main: str, report: Report) -> str:
    """Return the text of the trees of these missions, which have no mistakes."""
    exporter = _Exporter(report)
    trees = [exporter.tree(name, root) for name, root in missions.items()]
    models = [exporter.models[name] for name in sorted(exporter.models)]
    root = MadeElement("root", {"BTCPP_format": "4", "main_tree_to_execute": main}, trees)
    if models:
        root.children = [*trees, MadeElement("TreeNodesModel", {}, models)]
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + "\n".join(root.lines()) + "\n"


class _CannotError(ValueError):
    """Raised with the reason why something of a mission is no tree, and its place."""

    def __init__(self, span: Span, message: str, help_text: str = _HELP) -> None:
        super().__init__(message)
        self.span, self.help = span, help_text


def _text(node: TreeNode | None) -> str:
    return node.text if isinstance(node, ScalarNode) else ""


def _entries(node: TreeNode | None) -> Mapping[str, Entry]:
    return node.entries if isinstance(node, MappingNode) else {}


def _tree(node: TreeNode) -> syntax.ExpressionNode:
    if not isinstance(node, ScalarNode):
        raise _CannotError(node.span, "a list or a map is no value of a port")
    try:
        return expression_of(node).tree
    except ExpressionError as error:
        raise _CannotError(node.span, error.message) from None


def _flow(node: TreeNode) -> str:
    """Return a value in one line of YAML."""
    match node:
        case ScalarNode(text=text, plain=True) if not set(text) & set(",[]{}:#\n\"'&*!|>%@`"):
            return text
        case ScalarNode(text=text):
            return json.dumps(text, ensure_ascii=False)
        case SequenceNode(items=items):
            return f"[{', '.join(map(_flow, items))}]"
        case MappingNode(entries=entries):
            return f"{{{', '.join(f'{key}: {_flow(entry.value)}' for key, entry in entries.items())}}}"


class _Exporter:
    def __init__(self, report: Report) -> None:
        self.report = report
        self.models: dict[str, MadeElement] = {}

    # missions

    def tree(self, name: str, root: MappingNode) -> MadeElement:
        """Return the tree of a mission; what no tree can say is a finding."""
        for key, why in (("interrupts", "an interrupt"), ("machine", "a machine")):
            if key in root:
                help_text = "a '<ReactiveSequence>' does a part of what they do; start from a reactive 'sequence'"
                self.cannot(root.entries[key].key.span, f"BehaviorTree.CPP has nothing for {why}", help_text)
        found = MadeElement("BehaviorTree", {"ID": name})
        for key, attribute in (("about", nodes.ABOUT), ("rate", nodes.RATE)):
            if text := _text(root.get(key)):
                found.attributes[attribute] = text
        body = root.get("do")
        if body is not None:
            found.children.append(self.step(body))
            if data := _entries(root.get("data")):
                found.children = [MadeElement("Sequence", {nodes.DATA: "true"}, [self.data(data), *found.children])]
        self.interface(name, root)
        return found

    def interface(self, name: str, root: MappingNode) -> None:
        """Declare the inputs and outputs of a mission as ports of its tree."""
        ports: list[MadeElement] = []
        for key, entry in _entries(root.get("inputs")).items():
            port = MadeElement("input_port", {"name": key, f"{TWIN}input": _flow(entry.value)})
            given = _entries(entry.value).get("default")
            if given is not None and (default := _text(given.value)):
                port.attributes["default"] = default
            ports.append(port)
        for key, entry in _entries(root.get("outputs")).items():
            if _text(entry.value) != f"${key}":
                help_text = f"'set' the data '{key}' in the mission, and write '{key}: ${key}'"
                self.cannot(entry.key.span, f"the output '{key}' must be the data of that name", help_text)
            ports.append(MadeElement("output_port", {"name": key}))
        if ports:
            self.models[name] = MadeElement("SubTree", {"ID": name}, ports)

    def data(self, data: Mapping[str, Entry]) -> MadeElement:
        """Return the script that sets the data at the start."""
        codes = []
        for name, entry in data.items():
            try:
                code = script_of(_tree(entry.value))
            except (ScriptError, _CannotError):
                code = f"'{_text(entry.value)}'" if "'" not in _text(entry.value) else "''"
            codes.append(f"{name} := {code}")
        written = json.dumps({name: _flow(entry.value) for name, entry in data.items()}, ensure_ascii=False)
        return MadeElement("Script", {"code": "; ".join(codes), nodes.DATA: written})

    def cannot(self, span: Span, message: str, help_text: str = _HELP) -> MadeElement:
        """Report what is no tree, and return an element in its place."""
        self.report.add(CANNOT_EXPORT.at(span, message, help=help_text))
        return MadeElement("AlwaysFailure")

    # steps

    def step(self, node: TreeNode) -> MadeElement:
        """Return the element for a step, within those for its modifiers."""
        mapping = long_form(node)
        own = [key for key in mapping.entries if key not in anywhere()]
        key = next((key for key in own if key in kinds()), own[0])
        span = mapping.entries[key].key.span
        try:
            found = self.core(mapping, key)
            if name := _text(mapping.get("name")):
                found.attributes["name"] = name
            return self.modified(mapping, found)
        except _CannotError as error:
            return self.cannot(error.span, str(error), error.help)
        except ScriptError as error:
            return self.cannot(span, f"'{plain(key, 60)}' cannot be exported: {error}")

    def core(self, mapping: MappingNode, key: str) -> MadeElement:
        """Return the element for a step without its modifiers."""
        if key not in kinds():
            return self.skill(mapping, key)
        if key in ("sequence", "fallback"):
            return self.in_turn(mapping, key)
        if maker := _MAKERS.get(key):
            return maker(self, mapping)
        help_text = "make it a skill of the robot, or leave it out"
        raise _CannotError(mapping.entries[key].key.span, f"BehaviorTree.CPP has nothing for '{key}'", help_text)

    def options(self, mapping: MappingNode, *allowed: str) -> dict[str, str]:
        """Return the options of a step that differ from their defaults; one that is not allowed cannot be said."""
        found: dict[str, str] = {}
        kind = next(kinds()[key] for key in mapping.entries if key in kinds())
        for key, option in kind.fields.items():
            value = mapping.get(key)
            if (
                key == kind.name
                or not option.attribute
                or not isinstance(value, ScalarNode)
                or value.text in (option.default, str(option.default).lower())
            ):
                continue
            if key not in allowed:
                words = f"BehaviorTree.CPP has nothing for '{key}: {plain(value.text, 40)}' of '{kind.name}'"
                raise _CannotError(mapping.entries[key].key.span, words)
            found[key] = value.text
        return found

    def scripted(self, element: MadeElement, attribute: str, node: TreeNode | None) -> MadeElement:
        """Write a condition into an attribute, and how the mission writes it where that says more."""
        if node is None:
            raise _CannotError(Span("", 1, 1, 1, 1), "there is no condition")
        tree = _tree(node)
        try:
            code = script_of(tree)
        except ScriptError as error:
            raise _CannotError(node.span, str(error), "'set' a datum to it first, or make it a skill") from None
        element.attributes[attribute] = code
        if unplaced(condition(code)) != unplaced(tree):
            element.attributes[f"{TWIN}{attribute.lstrip('_')}"] = _text(node)
        return element

    def modified(self, mapping: MappingNode, element: MadeElement) -> MadeElement:
        """Return an element within those for the modifiers of its step."""
        entries = mapping.entries
        for key in ("attempt_timeout", "attempt_pause", "cooldown", "on_start"):
            if key in entries:
                raise _CannotError(entries[key].key.span, f"BehaviorTree.CPP has nothing for '{key}'")
        for node in (NODES["RetryUntilSuccessful"], NODES["Timeout"]):
            if node.word in entries:
                text = node.ports[node.port].write(_text(entries[node.word].value))
                element = MadeElement(node.name, {node.port: text}, [element])
        if "as_long_as" in entries:
            asked = self.scripted(MadeElement("ScriptCondition"), "code", mapping.get("as_long_as"))
            element = MadeElement("WhileDoElse", {}, [asked, element])
        if "save" not in entries:
            for key, attribute in _ATTRIBUTES.items():
                if key in entries:
                    self.assigned(element, attribute, self.hook(mapping, key))
        for name in ("Inverter", "ForceSuccess", "RunOnce"):
            if _text(mapping.get(NODES[name].word)) == "true":
                element = MadeElement(name, {}, [element])
        if "skip_if" in entries:
            self.scripted(element, "_skipIf", mapping.get("skip_if"))
        if "only_if" in entries:
            outer = self.scripted(MadeElement("Precondition"), "if", mapping.get("only_if"))
            outer.attributes["else"] = "SKIPPED"
            outer.children, element = [element], outer
        return element

    def hook(self, mapping: MappingNode, key: str) -> MappingNode:
        """Return what a hook sets; it must not do anything else."""
        hook = _entries(mapping.get(key))
        if hook.keys() == {"set"} and isinstance(assigned := hook["set"].value, MappingNode):
            return assigned
        words = f"'{key}' can only 'set' in a tree of BehaviorTree.CPP"
        raise _CannotError(mapping.entries[key].key.span, words)

    def assigned(self, element: MadeElement, attribute: str, assigned: MappingNode) -> MadeElement:
        """Write assignments as a script; none of them may read what an earlier one has set."""
        texts = {name: text_or_cannot(entry.value) for name, entry in assigned.entries.items()}
        done: set[str] = set()
        for name, entry in assigned.entries.items():
            tree = _tree(entry.value)
            if done & {node.name for node, _ in syntax.walk(tree) if isinstance(node, syntax.Variable)}:
                words = f"'{name}' reads what is set before it in a script"
                help_text = "keep the old value under another name, with an earlier 'set'"
                raise _CannotError(entry.key.span, words, help_text)
            done.add(name)
        try:
            code = assignments_script(texts)
        except ScriptError as error:
            raise _CannotError(assigned.span, str(error), "make it a skill") from None
        element.attributes[attribute] = code
        back = {each.to: unplaced(each.value) for each in statements(code)}
        if back != {name: unplaced(_tree(entry.value)) for name, entry in assigned.entries.items()}:
            element.attributes[f"{TWIN}{attribute.lstrip('_')}"] = json.dumps(texts, ensure_ascii=False)
        return element

    def in_turn(self, mapping: MappingNode, key: str) -> MadeElement:
        options = self.options(mapping, "reactive", "history")
        wanted = {name: True if text == "true" else text for name, text in options.items()}
        node = next(
            (row for row in NODES.values() if row.is_exported and row.word == key and row.options == wanted), None
        )
        if node is None:
            shown = ", ".join(f"'{name}: {text}'" for name, text in options.items())
            raise _CannotError(mapping.entries[key].key.span, f"BehaviorTree.CPP has no '{key}' with {shown}")
        return MadeElement(node.name, {}, self.steps(mapping.get(key)))

    def steps(self, node: TreeNode | None) -> list[MadeElement]:
        return [self.step(each) for each in node.items] if isinstance(node, SequenceNode) else []

    def check(self, mapping: MappingNode) -> MadeElement:
        value = mapping.get("check")
        match _tree(value) if value is not None else None:
            case syntax.Flag(value=holds):
                return MadeElement("AlwaysSuccess" if holds else "AlwaysFailure")
        return self.scripted(MadeElement("ScriptCondition"), "code", value)

    def wait_for(self, mapping: MappingNode) -> MadeElement:
        asked = self.scripted(MadeElement("ScriptCondition"), "code", mapping.get("wait_for"))
        return MadeElement("RetryUntilSuccessful", {"num_attempts": "-1"}, [asked])

    def wait(self, mapping: MappingNode) -> MadeElement:
        return MadeElement("Sleep", {"msec": nodes.MSEC.write(_text(mapping.get("wait")))})

    def set(self, mapping: MappingNode) -> MadeElement:
        assigned = mapping.get("set")
        found = assigned if isinstance(assigned, MappingNode) else MappingNode()
        return self.assigned(MadeElement("Script"), "code", found)

    def log(self, mapping: MappingNode) -> MadeElement:
        options = self.options(mapping, "level")
        self.model("Log", "Action", dict.fromkeys(("message", "level"), "input"))
        return MadeElement("Log", {"message": _text(mapping.get("log")), **options})

    def repeat(self, mapping: MappingNode) -> MadeElement:
        self.options(mapping)
        rounds = nodes.COUNT.write(_text(mapping.get("repeat")))
        body = [self.step(mapping.entries["do"].value)]
        if rounds == "-1":
            return MadeElement("KeepRunningUntilFailure", {}, body)
        return MadeElement("Repeat", {"num_cycles": rounds}, body)

    def loop(self, mapping: MappingNode) -> MadeElement:
        items = mapping.get("in")
        self.options(mapping, "in")
        body = [self.step(mapping.entries["do"].value)]
        value = {"value": f"{{{_text(mapping.get('for'))}}}"}
        if isinstance(items, ScalarNode):
            tree = _tree(items)
            if not isinstance(tree, syntax.Variable):
                raise _CannotError(items.span, "the list of a loop must have a name", "'set' a datum to it first")
            return MadeElement("LoopString", {"queue": f"{{{tree.name}}}", **value}, body)
        texts = [text_or_cannot(item) for item in items.items] if isinstance(items, SequenceNode) else []
        name, queue = queue_of(texts)
        twin = {f"{TWIN}queue": json.dumps(texts, ensure_ascii=False)}
        return MadeElement(name, {"queue": queue, **value, **twin}, body)

    def if_(self, mapping: MappingNode) -> MadeElement:
        asked = self.scripted(MadeElement("ScriptCondition"), "code", mapping.get("if"))
        return MadeElement("IfThenElse", {}, [asked, self.step(mapping.entries["then"].value), self.otherwise(mapping)])

    def otherwise(self, mapping: MappingNode) -> MadeElement:
        other = mapping.get("else")
        return MadeElement("AlwaysSuccess", {"_skipIf": "true"}) if other is None else self.step(other)

    def choose(self, mapping: MappingNode) -> MadeElement:
        value, entries = mapping.entries["choose"].value, _entries(mapping.get("cases"))
        tree = _tree(value)
        if not isinstance(tree, syntax.Variable):
            raise _CannotError(value.span, "BehaviorTree.CPP chooses by an entry", "'set' a datum to it first")
        if not 2 <= len(entries) <= 6:
            words = f"BehaviorTree.CPP chooses between 2 to 6 cases, and here are {len(entries)}"
            raise _CannotError(value.span, words, "write 'if' instead, or a second 'choose' under 'else'")
        found = MadeElement(f"Switch{len(entries)}", {"variable": f"{{{tree.name}}}"})
        for index, entry in enumerate(entries.values(), 1):
            match _tree(entry.key):
                case syntax.Word(name=name) | syntax.Text(value=name):
                    text = name
                case case:
                    text = script_of(case)
            found.attributes[f"case_{index}"] = text
            found.children.append(self.step(entry.value))
        found.children.append(self.otherwise(mapping))
        return found

    def parallel(self, mapping: MappingNode) -> MadeElement:
        key, branches = mapping.entries["parallel"].key, mapping.get("parallel")
        if "outcomes" in mapping:
            raise _CannotError(mapping.entries["outcomes"].key.span, "BehaviorTree.CPP has no outcomes of its own")
        options = self.options(mapping, "succeed_when", "fail_when", "wait_for_all")
        found = MadeElement("Parallel")
        if isinstance(branches, MappingNode):
            for name, entry in branches.entries.items():
                child = self.step(entry.value)
                child.attributes[nodes.BRANCH] = name
                found.children.append(child)
        else:
            found.children = self.steps(branches)
        many = len(found.children)
        words = {"all": "-1", "any": "1"}
        succeed, fail = options.get("succeed_when", "all"), options.get("fail_when", "any")
        wanted = words.get(succeed) or nodes.COUNT.write(succeed)
        fails = str(many) if fail == "all" else words.get(fail) or nodes.COUNT.write(fail)
        if any(count.isdecimal() and int(count) > many for count in (wanted, fails)):
            raise _CannotError(key.span, f"there are only {many} branches")
        if options.get("wait_for_all") == "true":
            words_ = "a '<ParallelAll>' succeeds whenever it does not fail"
            if not fails.isdecimal():
                raise _CannotError(key.span, words_, "write a number as 'fail_when', or leave out 'wait_for_all'")
            needed = many - int(fails) + 1
            if (wanted, fails) != ("-1", "1") and wanted != str(needed):
                raise _CannotError(key.span, words_, f"write 'succeed_when: {needed}'")
            found.name, found.attributes = "ParallelAll", {"max_failures": fails}
        else:
            found.attributes = {"success_count": wanted, "failure_count": fails}
        return found

    # skills and other missions

    def model(self, name: str, family: str, ports: Mapping[str, str]) -> None:
        """Declare a node of the program, or more ports of one."""
        known = self.models.setdefault(name, MadeElement(family, {"ID": name}))
        there = {port.attributes["name"] for port in known.children}
        known.children += [
            MadeElement(f"{how}_port", {"name": port}) for port, how in ports.items() if port not in there
        ]

    def value(self, node: TreeNode) -> str:
        """Return a value for a port: an entry, or a literal as it is written."""
        text = _text(node)
        if not isinstance(node, ScalarNode):
            raise _CannotError(node.span, "a list or a map is no value of a port", "give a datum that holds it")
        tree = None
        if "$" in text.replace("$$", ""):
            tree = _tree(node)
            if not isinstance(tree, syntax.Variable):
                raise _CannotError(node.span, "the value of a port is a literal or the name of an entry",
                                   "'set' a datum to it first")  # fmt: skip
            return f"{{{tree.name}}}"
        literal = text.replace("$$", "$")
        if nodes.entry_of(literal, "x"):
            raise _CannotError(node.span, "BehaviorTree.CPP takes this text for the name of an entry")
        return literal

    def skill(self, mapping: MappingNode, key: str) -> MadeElement:
        given = mapping.entries[key].value
        found = MadeElement(nodes.node_name(key))
        if isinstance(given, MappingNode):
            found.attributes = {name: self.value(entry.value) for name, entry in given.entries.items()}
        elif isinstance(given, SequenceNode) or given.text or not given.plain:
            found.attributes = {"value": self.value(given)}
        if found.attributes.keys() & {"name", "ID"}:
            words = "no port of BehaviorTree.CPP can be called 'name' or 'ID'"
            raise _CannotError(mapping.entries[key].key.span, words)
        ports = dict.fromkeys(found.attributes, "input")
        outputs = self.outputs(mapping, found, ("on_success",))
        self.model(found.name, "Action", {**ports, **dict.fromkeys(outputs, "output")})
        return found

    def use(self, mapping: MappingNode) -> MadeElement:
        self.options(mapping)
        found = MadeElement("SubTree", {"ID": _text(mapping.get("use"))})
        for name, entry in _entries(mapping.get("with")).items():
            found.attributes[name] = self.value(entry.value)
        self.outputs(mapping, found, ("on_success", "on_failure"))
        return found

    def outputs(self, mapping: MappingNode, element: MadeElement, hooks: tuple[str, ...]) -> list[str]:
        """Write what is kept of a result as output ports, if hooks do nothing but set data to it."""
        if "save" not in mapping:
            return []
        kept, span = _text(mapping.get("save")), mapping.entries["save"].key.span
        shown = " and ".join(f"'{hook}'" for hook in hooks)
        why = _CannotError(span, "a tree has output ports in place of 'save'",
                           f"'set' data to its values under {shown}, and nothing else, and read those")  # fmt: skip
        if [key for key in mapping.entries if key in (*_ATTRIBUTES, "on_start")] != list(hooks):
            raise why
        found: list[dict[str, str]] = []
        for hook in hooks:
            ports: dict[str, str] = {}
            for name, entry in self.hook(mapping, hook).entries.items():
                match _tree(entry.value):
                    case syntax.FieldAccess(of=syntax.Variable(name=of), name=port) if of == kept and port not in ports:
                        ports[port] = name
                    case _:
                        raise why
            found.append(ports)
        if any(ports != found[0] for ports in found) or found[0].keys() & element.attributes.keys():
            raise why
        element.attributes |= {port: f"{{{name}}}" for port, name in found[0].items()}
        element.attributes[f"{TWIN}save"] = kept
        return list(found[0])


def text_or_cannot(node: TreeNode) -> str:
    """Return the text of an expression; a word in quotes is a text."""
    tree = _tree(node)
    if isinstance(tree, syntax.Text) and isinstance(node, ScalarNode) and not node.plain:
        return text_of(tree)
    return _text(node)


_MAKERS: Mapping[str, Callable[[_Exporter, MappingNode], MadeElement]] = {
    "check": _Exporter.check,
    "wait_for": _Exporter.wait_for,
    "wait": _Exporter.wait,
    "set": _Exporter.set,
    "log": _Exporter.log,
    "repeat": _Exporter.repeat,
    "for": _Exporter.loop,
    "if": _Exporter.if_,
    "choose": _Exporter.choose,
    "parallel": _Exporter.parallel,
    "use": _Exporter.use,
}
