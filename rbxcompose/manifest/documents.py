"""Reading the files of one robot: each once, and of the required kind."""

from collections.abc import Collection, Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import Any, Literal

from rbxcompose.base.config import Config, Name
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import DID_YOU_MEAN, Finding, Related, Report, Span, kind, replacement, surely_meant
from rbxcompose.base.printable import plain
from rbxcompose.manifest.files import ROBOT_FILE, shown_name
from rbxcompose.manifest.foreign_words import FOREIGN
from rbxcompose.manifest.reader import Texts, read_file
from rbxcompose.manifest.shapes import field_types, keys_at
from rbxcompose.manifest.tree import Entry, KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, at
from rbxcompose.manifest.validate import KEYS, UNKNOWN_KEY, validate, where

KINDS = ("Robot", "Part", "Overlay", "Mission", "Test", "System", "World")
"""What a manifest may describe."""


class ManifestHeader(Config):
    """The keys at the start of every manifest."""

    rbx: Literal[1]
    """Version of the language."""
    kind: str
    """What this file describes: `Robot`, `Part`, `Overlay`, `Mission`, `Test`, `System` or `World`."""
    name: Name
    """Its name: lower-case letters, digits and underscores."""
    about: str = ""
    """What it is for, in a sentence."""


def misspelt_keys(root: MappingNode, keys: Collection[str]) -> dict[str, str]:
    """Return the misspelt keys of a map, each with the one of `keys` that it was surely meant to be."""
    found: dict[str, str] = {}
    for name in root.entries.keys() - {*keys}:
        meant = FOREIGN[name] if FOREIGN.get(name) in keys else surely_meant(name, keys)
        if meant is not None and meant not in root and meant not in found.values():
            found[name] = meant
    return found


def with_keys(root: MappingNode, meant: Mapping[str, str]) -> MappingNode:
    """Return a map whose misspelt keys are those that were meant."""
    if not meant:
        return root
    return replace(root, entries={meant.get(name, name): entry for name, entry in root.entries.items()})


OTHER_KIND = kind("RBX1304", is_fixable=True)


_Places = dict[KeyPath, list[str]]
"""The keys that a file takes, by place; all entries of a section stand for the first."""


@dataclass(slots=True)
class Documents:
    """The files of a robot: their texts for findings, and their paths by the names that findings show."""

    report: Report
    sources: dict[str, str]
    files: dict[str, Path] = field(default_factory=dict)

    def read(self, file: Path, wanted: str, span: Span | None = None) -> MappingNode | None:
        """Return the tree of a manifest of the wanted kind, or None after findings.

        `span` is the place that names the file; findings about the whole file point there.
        """
        shown = shown_name(file)
        self.files[shown] = file
        root, findings = read_file(file, shown, self.sources)
        self.report.extend(replace(one, span=one.span or span) for one in findings)
        if root is None:
            return None
        if finding := _trouble(root, wanted):
            if span and finding.span and file.name == ROBOT_FILE:  # another file was meant
                because = (Related(finding.span, f"what kind '{plain(shown)}' is"), *finding.related)
                message = f"this must name a file of kind {wanted}"
                self.report.add(replace(finding, span=span, message=message, help="", related=because))
            else:
                related = (Related(span, f"this needs a {wanted}"),) if span else ()
                self.report.add(replace(finding, related=(*finding.related, *related)))
            return None
        return root if isinstance(root, MappingNode) else None

    def use(self, file: Path, root: MappingNode) -> Finding | None:
        """Count a file that is used once more; return the finding if the robot has become too large."""
        return self.sources.use(shown_name(file), root) if isinstance(self.sources, Texts) else None

    def writer(self, span: Span, robot: Path) -> Path:
        """Return the file that a value was written in; the robot's file for a value from the command line."""
        return self.files.get(span.file, robot)

    def meant(self, model: type[ManifestHeader], root: MappingNode) -> MappingNode:
        """Return a file with its misspelt keys corrected, after a finding for each."""
        meant = misspelt_keys(root, model.model_fields)
        for name, ours in meant.items():
            span, message = root.entries[name].key.span, f"unknown key '{plain(name, 60)}' in {where(())}"
            if name in FOREIGN:  # a word of another tool, not one that is spelt like ours
                fix = replacement(span, name, ours, is_safe=False)  # what stands below may have another form
                self.report.add(UNKNOWN_KEY.at(span, message, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix))
            else:
                self.report.add(UNKNOWN_KEY.misspelt(span, message, name, model.model_fields, KEYS, taken=root.entries))
        return with_keys(root, meant)

    def placed(self, model: type[ManifestHeader], root: MappingNode, sections: Mapping[str, Any]) -> MappingNode:
        """Return a file without the keys that belong elsewhere in it, after a finding for each that says where.

        `sections` have the models of its sections: one map, a map of named entries, or a list of items.
        """
        places: _Places = {(): [name for name in field_types(model) if name not in ManifestHeader.model_fields]}
        for name, section in sections.items():
            for place in ((), (0,)):
                if keys := keys_at(section, place):
                    places[name, *place] = keys
        entries = dict(root.entries)
        for name in sections.keys() & root.entries.keys():
            entries[name] = replace(entries[name], value=self._placed(entries[name].value, (name,), places, root))
        whole = self._placed(replace(root, entries=entries), (), places, root)
        return whole if isinstance(whole, MappingNode) else root

    def _placed(self, node: TreeNode, path: KeyPath, places: _Places, root: MappingNode) -> TreeNode:
        """Return a node without the keys of other places."""
        place = path if len(path) < 2 else (path[0], 0)
        if path and (*place, 0) in places:
            match node:
                case SequenceNode(items=items):
                    inner = (self._placed(item, (*path, index), places, root) for index, item in enumerate(items))
                    return replace(node, items=tuple(inner))
                case MappingNode(entries=entries):
                    values = {
                        name: self._placed(entry.value, (*path, name), places, root) for name, entry in entries.items()
                    }
                    return replace(node, entries={name: replace(entries[name], value=values[name]) for name in entries})
        own = places.get(place)
        if own is None or not isinstance(node, MappingNode):
            return node
        left = dict(node.entries)
        for name, entry in node.entries.items():
            homes = [other for other, keys in places.items() if name in keys]
            is_ours = (
                name in (*own, *ManifestHeader.model_fields)
                or FOREIGN.get(name) in own
                or surely_meant(name, own) is not None
            )
            if not is_ours and len(homes) == 1:
                del left[name]
                message = f"unknown key '{plain(name, 60)}' in {where(path)}"
                help_text = _home(homes[0], places, root)
                self.report.add(UNKNOWN_KEY.at(entry.key.span, message, help=help_text, about=[name]))
        return replace(node, entries=left)

    def check(self, model: type[ManifestHeader], root: MappingNode) -> None:
        """Add findings for the top-level keys of a file; the contents of a section are checked where it is read."""
        anything = {name for name, field in model.model_fields.items() if field.annotation is Any}
        keys = {
            name: Entry(entry.key, ScalarNode("", entry.value.span)) if name in anything else entry
            for name, entry in root.entries.items()
        }
        validate(model, replace(root, entries=keys), (), self.report)


def _home(place: KeyPath, places: _Places, root: MappingNode) -> str:
    """Return in words where a key belongs, beside one that is written there if there is any."""
    there = at(root, place)
    keys = there.entries if isinstance(there, MappingNode) and len(place) < 2 else {}
    beside = next((key for key in places[place] if key in keys), "")
    match place:
        case ():
            where_ = "at the left margin"
        case (section,):
            where_ = f"below '{section}'"
        case (section, *_):
            return f"it belongs to an entry of '{section}'"
    return f"it belongs {where_}" + (f", beside '{beside}'" if beside else "")


def _trouble(root: TreeNode, wanted: str) -> Finding | None:
    """Return the finding for a document of another kind, None if it is of the wanted one."""
    if not isinstance(root, MappingNode):
        return OTHER_KIND.at(root.span, "a manifest is a map that starts with 'rbx: 1' and 'kind:'")
    written = root.get("kind")
    if not isinstance(written, ScalarNode) or written.text == wanted:
        return None
    message = f"this is not a manifest of kind {wanted}"
    return OTHER_KIND.misspelt(written.span, message, written.text, [wanted], "the kind needed here")
