"""Slips in lines and keys: indentation, colons, first lines, what is no YAML; keys of other tools, or misplaced."""

import re
from dataclasses import replace

from rbxcompose.base.findings import DID_YOU_MEAN, Edit, Finding, Fix, Related, replacement
from rbxcompose.base.printable import plain
from rbxcompose.manifest import slips
from rbxcompose.manifest.documents import KINDS
from rbxcompose.manifest.foreign_words import CURES, FOREIGN
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import ROBOT, misplaced
from rbxcompose.manifest.shapes import keys_at
from rbxcompose.manifest.slips import RefusedValue, Repair, value_slip
from rbxcompose.manifest.slips.lists import missing_dash
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, plain_value

KEY, VERSION = "rbx", "1"


@slips.value_slip("missing")
def first_line(place: slips.RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it; there is a fix if it is a file of ours, and its first key is known and begins its line."""
    if place.path != (KEY,) or not isinstance(node, MappingNode):
        return None
    line = f"{KEY}: {VERSION}"
    first = next((entry.key for entry in node.entries.values() if entry.key.span[:3] == node.span[:3]), None)
    fix = None
    kind = node.get("kind")
    is_ours = isinstance(kind, ScalarNode) and kind.text in KINDS
    if is_ours and first and first.plain and first.span.column == 1:
        edits = replacement(first.span, first.text, f"{line}\n{first.text}").edits
        fix = Fix(edits, True, f"'{line}' before '{first.text}'")
    help_text = f"write '{line}' in the first line: the version of the language"
    right = Entry(ScalarNode(KEY, node.span), ScalarNode(VERSION, node.span))
    finding = replace(place.finding, help=help_text, fix=fix)
    return Repair(MappingNode({KEY: right, **node.entries}, node.span), (finding,))


_COMMENTS = ("//", "/*", "<!--")
_MARKS = ("<<<<<<< ", ">>>>>>> ")


@slips.text_slip(slips.ANY)
def foreign_lines(trouble: slips.Trouble) -> Finding | None:
    """Recognise a comment at the error or just above it, and marks of git anywhere in the text."""
    marked = [number for number, line in enumerate(trouble.lines) if line.startswith(_MARKS)]
    if len(marked) > 1:
        message = "git has left a merge here for you to decide"
        help_text = f"keep one of the two versions, and remove the lines with '{'<' * 7}', '{'=' * 7}' and '{'>' * 7}'"
        return slips.NOT_YAML.at(trouble.span(marked[0], 0, len(trouble.lines[marked[0]])), message, help=help_text)
    near = (trouble.line, trouble.opening.line - 1, next(trouble.above(trouble.line), 0))
    for number in near:
        line = trouble.lines[number] if number < len(trouble.lines) else ""
        text = line.strip()
        if text.startswith(_COMMENTS):
            start = len(line) - len(line.lstrip())
            span = trouble.span(number, start, len(line.rstrip()))
            fix = None
            if text.startswith(_COMMENTS[0]):
                edit = Edit(span, text, f"#{text.removeprefix(_COMMENTS[0])}")
                fix = Fix((edit,), True, "'//' -> '#'")
            return slips.NOT_YAML.at(
                span, "this is not how a comment begins in YAML", help="begin it with '#'", fix=fix
            )
    return None


# Keys of manifests and skills whose value is a text for people, which may contain a colon.
TEXTS = ("about", "description", "label", "log", "message", "name", "say", "text", "title")
_KEY = r"[a-z][a-z0-9_]*"
_KEY_LINE = re.compile(rf" *+(- ++)*{_KEY}:( |$)")
_IN_LINE = re.compile(rf"(?P<before> *+(?:- ++)*)(?P<outer>{_KEY}): ++(?P<inner>{_KEY}: ++\S.*)")
_PAIRS = re.compile(rf",\s++(?={_KEY}: )")
_DEEPER = 2


@slips.text_slip(slips.COLON)
def key_in_line(trouble: slips.Trouble) -> Finding | None:
    """Recognise two keys on one line.

    A text for people may begin with a word and a colon; and if the value contains quotes, its meaning is unclear.
    """
    found = _IN_LINE.fullmatch(trouble.line_text.rstrip(" ")) if trouble.value_column else None
    if found is None or found["outer"] in TEXTS or set(found["inner"]) & set("'\"#"):
        return None
    outer, inner = found["outer"], found["inner"]
    pairs = _PAIRS.split(inner)
    what = " and ".join(f"'{pair}'" for pair in pairs)
    where = "a line of its own" if len(pairs) == 1 else "lines of their own"
    help_text = f"put {what} on {where} below '{outer}:', further right"
    below, start = trouble.next_line(trouble.line), len(found["before"])
    goes_on = slips.indent(below) > start
    if not goes_on:
        help_text += "; a text needs quotes"
    column = slips.indent(below) if goes_on else start + _DEEPER
    place = trouble.span(trouble.line, start + len(outer), found.end("inner"))
    text = ":" + "".join(f"\n{' ' * column}{pair}" for pair in pairs)
    edit = Edit(place, found[0][start + len(outer) :], text)
    # Only if more keys follow below it, it cannot be text.
    fix = Fix((edit,), goes_on and bool(_KEY_LINE.match(below)), f"'{outer}: {inner}' on {len(pairs) + 1} lines")
    message = f"two keys are on one line: '{outer}' and '{pairs[0].partition(':')[0]}'"
    return slips.NOT_YAML.at(place._replace(column=found.start("inner") + 1), message, help=help_text, fix=fix)


_TIGHT = re.compile(r"[a-z][a-z0-9_]*:(?!//)(?=\S)")


@slips.text_slip(slips.COLON, slips.NO_COLON, after=(key_in_line, missing_dash))
def tight_colon(trouble: slips.Trouble) -> Finding | None:
    """Recognise a key that was read as text: in the line above, or where the parser expected a colon."""
    if trouble.value_column and slips.COLON in trouble.problem:
        return None
    is_above = slips.COLON in trouble.problem
    line = trouble.line - 1 if is_above else trouble.opening.line - 1
    text = trouble.lines[line] if line >= 0 else ""
    column = slips.behind_dashes(text) if is_above else trouble.opening.column - 1
    found = _TIGHT.match(text, column)
    if found is None:
        return None
    span, message = trouble.span(line, column, found.end()), "a space is missing after this colon"
    return slips.NOT_YAML.at(span, message, help="write 'key: value'", fix=replacement(span, found[0], f"{found[0]} "))


_STEP = re.compile(r"(?P<before> *+(- ++)*)(?P<word>[a-z][a-z0-9_]*)(?P<value> ++[^\s:#][^:#]*)?")


@slips.text_slip(slips.COLON, after=(tight_colon,))
def step_without_colon(trouble: slips.Trouble) -> Finding | None:
    """Recognise a word, perhaps with a value, directly above a line indented below it."""
    line = trouble.line - 1
    step = _STEP.fullmatch(trouble.lines[line].rstrip(" ")) if line >= 0 and not trouble.value_column else None
    if not step or slips.indent(trouble.line_text) < len(step["before"]):
        return None
    word, value = step["word"], (step["value"] or "").strip()
    span = trouble.span(line, step.start("word"), step.end("word"))
    fix = replacement(span, word, f"{word}:", is_safe=not value)  # a word with a value may also be a text
    message = "a step with settings below it needs a colon"
    help_text = f"write '{word}: {value}'" if value else f"write '{word}:'"
    below = (Related(trouble.here, "this is below it"),)
    return slips.NOT_YAML.at(span, message, label="put a colon here", help=help_text, related=below, fix=fix)


_TOO_FAR_LEFT_KEY_LINE = re.compile(r" *+(- ++)*[a-z][a-z0-9_]*:( |$)")
_FULL_LINE = re.compile(r" *+[a-z][a-z0-9_]*: ++[^\s#].*")


@slips.text_slip(slips.COLON, slips.NO_KEY, slips.NO_DASH, after=(step_without_colon,))
def too_far_left(trouble: slips.Trouble) -> Finding | None:
    """Recognise it by the line below it: that of the error, or the next one."""
    if (slips.COLON in trouble.problem and trouble.value_column) or (
        slips.NO_KEY in trouble.problem and trouble.is_behind_quote
    ):
        return None
    lines = trouble.lines
    below = next((index for index in range(trouble.line + 1, len(lines)) if lines[index].strip()), None)
    found = (_outlier(trouble, line) for line in (trouble.line, below) if line is not None)
    return next((finding for finding in found if finding), None)


def _outlier(trouble: slips.Trouble, line: int) -> Finding | None:
    """Return the finding about the line above one that is in the column of the line before that."""
    lines = trouble.lines
    above = next(trouble.above(line), None)
    before = next(trouble.above(above), None) if above is not None else None
    if above is None or before is None or not _FULL_LINE.fullmatch(lines[above]):
        return None
    start, column = slips.indent(lines[above]), slips.indent(lines[line])
    if not (start < column == slips.behind_dashes(lines[before]) and _TOO_FAR_LEFT_KEY_LINE.match(lines[line])):
        return None
    key = lines[above].strip().partition(":")[0]
    beside = lines[before].lstrip(" -").partition(":")[0].strip()
    how_far = f"{column - start} {'column' if column - start == 1 else 'columns'}"
    help_text = f"move it {how_far} to the right, into the column of '{beside}'"
    return slips.NOT_YAML.at(trouble.span(above, start, start + len(key)), f"'{key}' is too far left", help=help_text)


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


@value_slip("string_pattern_mismatch", before=[slash_for_a_dot])
def topic_for_a_port(place: RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise it in the section `values`: it begins with a slash."""
    if place.path[0] != "values" or not isinstance(node, ScalarNode) or not node.text.startswith("/"):
        return None
    meant = f"topic: {node.text}" if place.path[-1] == "port" else f"{{topic: {node.text}}}"
    finding = replace(place.finding, help=f"a name that begins with '/' is a topic: write '{meant}'")
    any_port = f"{node.text[1:].replace('/', '_')}.data"  # so that the rest is read, too; it is not written
    return Repair(replace(node, text=any_port), (finding,))


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
