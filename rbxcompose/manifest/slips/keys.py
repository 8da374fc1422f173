"""Slips in keys: those of other tools, and those at the wrong level."""

from dataclasses import replace

from rbxcompose.base.findings import DID_YOU_MEAN, replacement
from rbxcompose.base.printable import plain
from rbxcompose.manifest.foreign_words import CURES, FOREIGN
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import ROBOT, misplaced
from rbxcompose.manifest.shapes import keys_at
from rbxcompose.manifest.slips import RefusedValue, Repair, value_slip
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, plain_value


@value_slip("extra_forbidden")
def foreign_key(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it where our key for it is known and not written."""
    key, ours = str(place.path[-1]), FOREIGN.get(str(place.path[-1]), "")
    if ours not in place.keys or not isinstance(node, MappingNode) or ours in node:
        return None
    entry = node.entries[key]
    fix = replacement(entry.key.span, key, ours, is_safe=False)  # its value may have another form
    entries = {ours if name == key else name: one for name, one in node.entries.items()}
    entries[ours] = Entry(replace(entry.key, text=ours), entry.value)
    finding = replace(place.finding, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix)
    return Repair(MappingNode(entries, node.span), (finding,))


_ALWAYS = "ros__parameters"
_OFTEN = ("config", "configuration", "options", "parameters", "params", "settings")


@value_slip("extra_forbidden")
def nested_settings(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the key of ROS, and other words if keys that are known here stand below them."""
    key = str(place.path[-1])
    inner = node.get(key) if isinstance(node, MappingNode) else None
    if not isinstance(node, MappingNode) or not isinstance(inner, MappingNode):
        return None
    if key != _ALWAYS and not (key in _OFTEN and any(name in place.keys for name in inner.entries)):
        return None
    left = {name: entry for name, entry in node.entries.items() if name != key}
    help_text = f"remove '{key}:' and move what is below it to the left, into its column"
    finding = replace(place.finding, help=help_text)
    return Repair(MappingNode({**inner.entries, **left}, node.span), (finding,))


_FRAMES = ("frame", "frame_id", "header", "in")


@value_slip("extra_forbidden")
def frame_of_place(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it in the section `places`."""
    key = str(place.path[-1])
    if place.path[0] != "places" or key not in _FRAMES or not isinstance(node, MappingNode):
        return None
    help_text = f"places are always in 'map': give 'x' and 'y' there, and remove '{key}'"
    left = {name: entry for name, entry in node.entries.items() if name != key}
    return Repair(MappingNode(left, node.span), (replace(place.finding, help=help_text),))


@value_slip("string_pattern_mismatch")
def slash_for_a_dot(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a path of two names."""
    if not isinstance(node, ScalarNode) or node.text.strip("/").count("/") != 1:
        return None
    meant = node.text.strip("/").replace("/", ".")
    fix = replacement(node.span, node.text, meant)
    finding = replace(place.finding, help=f"a component and its port are joined by a dot: write '{meant}'", fix=fix)
    return Repair(replace(node, text=meant), (finding,))


@value_slip("model_type", "model_attributes_type")
def word_for_a_map(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a word; it counts only if the map accepts it there."""
    is_word = isinstance(node, ScalarNode) and isinstance(plain_value(node), str) and node.text[:1].isalpha()
    if not is_word or not isinstance(node, ScalarNode) or not place.keys:
        return None
    first, key = place.keys[0], place.path[-1]
    help_text = f"write '{key}: {{{first}: {plain(node.text, 60)}}}'"
    meant = MappingNode({first: Entry(ScalarNode(first, node.span), node)}, node.span)
    return Repair(meant, (replace(place.finding, help=help_text),))


@value_slip("extra_forbidden", after=(foreign_key,))
def section_too_deep(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise its name; an entry with the name of a section is found where the entries are read."""
    key = str(place.path[-1])
    section = next((section for section in sections(ROBOT) if section.name == key), None)
    if not isinstance(node, MappingNode) or section is None:
        return None
    entry = node.entries[key].value
    keys = () if section.is_map else keys_at(section.model, ())
    if keys and isinstance(entry, MappingNode) and entry.entries and not any(name in keys for name in entry.entries):
        return None  # it only has the name of a section
    left = {name: entry for name, entry in node.entries.items() if name != key}
    if len(place.path) == 1:  # a section that this kind of file cannot have
        help_text = f"'{key}' belongs to the file of the robot: move it there"
        return Repair(MappingNode(left, node.span), (replace(place.finding, help=help_text, fix=None),))
    return Repair(MappingNode(left, node.span), (misplaced(node.entries[key].key, str(place.path[0])),))


@value_slip("extra_forbidden", before=(section_too_deep,))
def no_counterpart(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it by its name; a map below the name of a section is that section, indented too far."""
    key = str(place.path[-1])
    cure = CURES.get(key)
    if cure is None or not isinstance(node, MappingNode) or key in place.keys:
        return None
    if key == "profiles" and isinstance(node.entries[key].value, MappingNode):
        return None
    left = {name: entry for name, entry in node.entries.items() if name != key}
    return Repair(MappingNode(left, node.span), (replace(place.finding, help=cure, fix=None),))
