"""No importer drops a key silently: what each known key says is in the manifest, or a finding is about it."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose.base.findings import Report, Span
from rbxcompose.commands.importing.foreign_files import ForeignFile, ForeignMap, read_files
from rbxcompose.commands.importing.importer import PLUGINS, imported
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from tests.importing.imports import EXAMPLES
from tests.loops import for_all

Key = tuple[str, str]
"""The type of the map that has a key, as far as it has one, and the key."""
ELEMENT, ATTRIBUTE = re.compile(r"<(\w+)([^<>?!]*?)/>"), re.compile(r'(\w+)="[^"]*"')
LEFT_OUT = re.compile(r"(\w+ )?'[^']*' (is|are) (not carried over|left out):")  # with all that is in it
OF_SRDF = {  # what MoveIt reads
    "chain": ("base_link", "tip_link"),
    "joint": ("name", "value"),
    "link": ("name",),
    "group": ("name",),
    "end_effector": ("name", "parent_link", "group", "parent_group"),
    "virtual_joint": ("name", "type", "parent_frame", "child_link"),
    "passive_joint": ("name",),
    "disable_collisions": ("link1", "link2", "reason"),
}

COPIES = {("params", "groups")}  # of a dump: the same values, by groups


def key_of(node: MappingNode, key: str) -> Key:
    type_ = node.get("type") or node.get("model")
    return type_.text.rpartition("/")[2] if isinstance(type_, ScalarNode) and key != "type" else "", key


def without(node: TreeNode, above: tuple[Span, ...] = ()) -> Iterator[tuple[Key, tuple[Span, ...], TreeNode]]:
    """Yield each key of a tree, the places of what it is in, and the tree without it; all else stays in its place."""
    if isinstance(node, MappingNode):
        types = [node.entries["type"].value.span] if "type" in node.entries else []
        for key, entry in node.entries.items():
            others = {name: one for name, one in node.entries.items() if name != key}
            yield key_of(node, key), (*above, *types), replace(node, entries=others)
            for found, places, made in without(entry.value, (*above, entry.key.span, *types)):
                yield found, places, replace(node, entries={**node.entries, key: replace(entry, value=made)})
    if isinstance(node, SequenceNode):
        for index, item in enumerate(node.items):
            for found, places, made in without(item, above):
                yield found, places, replace(node, items=(*node.items[:index], made, *node.items[index + 1 :]))


def without_in_xml(text: str) -> Iterator[tuple[Key, tuple[Span, ...], str]]:
    """Yield each attribute of a text and the text without it, in which all else stays in its place."""
    for element in ELEMENT.finditer(text):
        for attribute in ATTRIBUTE.finditer(text, *element.span(2)):
            start, end = attribute.span()
            yield (element[1], attribute[1]), (), f"{text[:start]}{' ' * (end - start)}{text[end:]}"


def variants(file: ForeignFile) -> Iterator[tuple[Key, tuple[Span, ...], ForeignFile]]:
    if file.name.endswith((".srdf", ".xml")) and ".launch" not in file.name:  # whose elements are reported as a whole
        for key, places, text in without_in_xml(file.text):
            yield key, places, replace(file, text=text)
    elif not file.name.endswith(".urdf"):  # which is not carried over but referred to
        for key, places, root in without(file.root):
            yield key, places, replace(file, root=root)


Result = tuple[str, Mapping[str, str], list[str], set[Span]]


def result_of(program: str, files: list[ForeignFile]) -> Result:
    report = Report()
    made = imported(program, files, "tried", report)
    findings = [f"{finding.code} {finding.span} {finding.message}" for finding in report]
    left_out = {finding.span for finding in report if finding.span and LEFT_OUT.match(finding.message)}
    return made.text, made.beside, findings, left_out


@for_all("program", PLUGINS.names())
def test_each_known_key_is_carried_over_or_reported(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: set[Key] = set()
    ask = ForeignMap._ask

    def noted(self: ForeignMap, key: str) -> TreeNode | None:
        asked.add(key_of(self.node, key))
        return ask(self, key)

    monkeypatch.setattr(ForeignMap, "_ask", noted)
    groups: defaultdict[str, list[Path]] = defaultdict(list)
    for path in sorted(path for path in (EXAMPLES / program).iterdir() if path.is_file()):
        groups[path.stem].append(path)
    matters: dict[Key, bool] = {}
    for paths in groups.values():
        report = Report()
        files = read_files(paths, report, {})
        assert not list(report)
        whole = result_of(program, files)
        for index, file in enumerate(files):
            for key, places, changed in variants(file):
                if not matters.get(key):
                    made = result_of(program, [*files[:index], changed, *files[index + 1 :]])
                    matters[key] = made[:3] != whole[:3] or not whole[3].isdisjoint(places)
    asked |= {(element, key) for element, keys in OF_SRDF.items() for key in keys} if program == "srdf" else set()
    assert asked <= matters.keys(), f"give an example in a file of this folder: {sorted(asked - matters.keys())}"
    dropped = [key for key, is_it in matters.items() if not is_it and (program, key[1]) not in COPIES]
    assert not dropped, f"neither carried over nor reported: {dropped}"
