"""The trees in files of BehaviorTree.CPP, with those that they include, and the models of their nodes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Related, Report, Span
from rbxcompose.base.printable import plain
from rbxcompose.commands.importing.foreign_files import ForeignFile
from rbxcompose.commands.importing.importer import OTHER_PROGRAM
from rbxcompose.domains.body.xml_reader import XmlElement, XmlFormat, read_xml
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.reader import read_source
from rbxcompose.tools.behaviour_trees.nodes import DIFFERS, EXPLICIT, MISTAKE, OLD_NAMES, entry_of

FORMAT = XmlFormat("root", "a file of trees", OTHER_PROGRAM)
TREE, MODELS = "BehaviorTree", "TreeNodesModel"
DIRECTIONS = {"input_port": "input", "output_port": "output", "inout_port": "inout"}
_SHOWN = 60


@dataclass(frozen=True, slots=True)
class ModelPort:
    """A port that a model declares."""

    direction: str
    element: XmlElement


@dataclass(frozen=True, slots=True)
class NodeModel:
    """What a file declares about a node: its family (`Action`, `Condition`, `SubTree`, ...), and its ports by name."""

    family: str
    ports: dict[str, ModelPort]
    span: Span


@dataclass(slots=True)
class Forest:
    """All trees by their IDs, the models of nodes, and the tree that the first file names as its main one."""

    trees: dict[str, XmlElement] = field(default_factory=dict)
    models: dict[str, NodeModel] = field(default_factory=dict)
    named_main: str = ""
    files: list[str] = field(default_factory=list)


def type_of(element: XmlElement) -> str:
    """Return which node an element is: its name, or its ID in the explicit form; empty if that is missing."""
    if element.name in EXPLICIT or element.name == "SubTreePlus":
        return "SubTree" if element.name.startswith("SubTree") else element.attributes.get("ID", "")
    return OLD_NAMES.get(element.name, element.name)


def ports_of(element: XmlElement) -> dict[str, str]:
    """Return the attributes of an element that are ports."""
    return {key: text for key, text in element.attributes.items() if key not in ("name", "ID") and key[0] != "_"}


def below(element: XmlElement) -> Iterator[XmlElement]:
    """Yield all elements below one, in the order of the text."""
    waiting = list(reversed(element.children))
    while waiting:
        found = waiting.pop()
        yield found
        waiting += reversed(found.children)


def read_forest(files: Sequence[ForeignFile], report: Report) -> Forest:
    """Return the trees of files, and of those that they include."""
    return _ForestReader(report).read(files)


class _ForestReader:
    def __init__(self, report: Report) -> None:
        self.report, self.forest = report, Forest()
        self.sources: dict[str, str] = {}
        self.seen: set[Path] = set()
        self.unnamed = 0

    def read(self, files: Sequence[ForeignFile]) -> Forest:
        for file in files:
            self.forest.files.append(file.name)
            if file.path is not None:
                self.seen.add(file.path.resolve())
            waiting = [(file.text, file.name, file.path)]
            while waiting:
                root = read_xml(*waiting[0][:2], FORMAT)
                path = waiting.pop(0)[2]
                if isinstance(root, Finding):
                    self.report.add(root)
                    continue
                if not self.forest.trees and "main_tree_to_execute" in root.attributes:
                    self.forest.named_main = root.attributes["main_tree_to_execute"]
                self._root(root)
                waiting = [*self._included(root, path), *waiting]
        return self.forest

    def _root(self, root: XmlElement) -> None:
        version = root.attributes.get("BTCPP_format")
        if version is None:
            words = "there is no 'BTCPP_format' here: for version 4, a text without braces is no entry in a '<SubTree>'"
            help_text = 'write \'<root BTCPP_format="4">\', or "3", for which it names an entry'
            self.report.add(DIFFERS.at(root.span, words, help=help_text))
        elif version.strip() == "3":
            for element in below(root):
                for port, text in ports_of(element).items() if element.name == "SubTree" else ():  # not 'SubTreePlus'
                    element.attributes[port] = text if not text or entry_of(text, port) else f"{{{text}}}"
        elif version.strip() != "4":
            words = f"'BTCPP_format' is '{plain(version, 20)}'; only 3 and 4 exist"
            self.report.add(MISTAKE.at(root.span, words, help='write BTCPP_format="4"'))
        for element in root.children:
            if element.name == TREE:
                self._tree(element)
            elif element.name == MODELS:
                for model in element.children:
                    self._model(model)
            elif element.name != "include":
                words = f"'<{plain(element.name, _SHOWN)}>' is neither a tree nor a model of nodes"
                self.report.add(MISTAKE.at(element.span, words, help=f"put nodes into a '<{TREE}>'"))

    def _tree(self, element: XmlElement) -> None:
        name = element.attributes.get("ID", "")
        if not name:
            name = f"BehaviorTree_{self.unnamed}"
            self.unnamed += 1
        if name in self.forest.trees:
            first = [Related(self.forest.trees[name].span, "the first one")]
            words = f"two trees have the ID '{plain(name, _SHOWN)}'; the first one counts"
            self.report.add(MISTAKE.at(element.span, words, related=first))
        elif len(element.children) != 1:
            words = f"the tree '{plain(name, _SHOWN)}' must have exactly one child, and has {len(element.children)}"
            self.report.add(MISTAKE.at(element.span, words, help="put them into a '<Sequence>'"))
        else:
            self.forest.trees[name] = element

    def _model(self, element: XmlElement) -> None:
        name = element.attributes.get("ID", "")
        if element.name not in EXPLICIT or not name:
            help_text = f"write one of {', '.join(EXPLICIT)}, with an 'ID'"
            self.report.add(MISTAKE.at(element.span, "this is not the model of a node", help=help_text))
            return
        ports: dict[str, ModelPort] = {}
        for port in element.children:
            key = port.attributes.get("name", "")
            if port.name not in DIRECTIONS or not key:
                if port.name in DIRECTIONS:
                    self.report.add(MISTAKE.at(port.span, f"a port of '{plain(name, _SHOWN)}' has no 'name'"))
            elif key in ports:
                words = f"'{plain(name, _SHOWN)}' declares the port '{plain(key, _SHOWN)}' twice"
                related = [Related(ports[key].element.span, "the first one")]
                help_text = "a port that is both is an '<inout_port>'"
                self.report.add(MISTAKE.at(port.span, words, help=help_text, related=related))
            else:
                ports[key] = ModelPort(DIRECTIONS[port.name], port)
        self.forest.models.setdefault(name, NodeModel(element.name, ports, element.span))

    def _included(self, root: XmlElement, path: Path | None) -> Iterator[tuple[str, str, Path | None]]:
        for element in root.all("include"):
            written = element.attributes.get("path", "")
            if not written or path is None or "ros_pkg" in element.attributes:
                why = "it names a package of ROS" if written else "it has no 'path'"
                help_text = "give that file to the import, too"
                self.report.add(MISTAKE.at(element.span, f"this file is not included: {why}", help=help_text))
                continue
            found = (path.parent / written).resolve()
            if found in self.seen:
                continue
            self.seen.add(found)
            text, findings = read_source(found, shown_name(found), self.sources, what="an imported file")
            if text is None:
                words = f"'{plain(written, _SHOWN)}' cannot be included: {findings[0].message}"
                self.report.add(MISTAKE.at(element.span, words))
            else:
                yield text, shown_name(found), found
