"""Validation of a located tree against a model: pydantic's errors, at their places and in plain words."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from itertools import islice
from typing import Any, TypeVar, cast, get_args, get_origin

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails, SchemaValidator

from rbxcompose.base.config import Place, Secret
from rbxcompose.base.expressions.parser import CURLY_QUOTES
from rbxcompose.base.findings import DID_YOU_MEAN, SIMILAR, Finding, Report, Span, correction, kind, replacement
from rbxcompose.base.printable import plain
from rbxcompose.base.units import NUMBER, Quantity, UnitError, format_quantity, parse_quantity
from rbxcompose.manifest import tree
from rbxcompose.manifest.foreign_words import CHOICES as FOREIGN_CHOICES
from rbxcompose.manifest.foreign_words import FOREIGN
from rbxcompose.manifest.reader import UNREADABLE
from rbxcompose.manifest.shapes import alternatives, dimension_at, field_types, keys_at, models_at
from rbxcompose.manifest.slips import RefusedValue, value_slip
from rbxcompose.manifest.tree import KeyPath, TreeNode, describe, is_empty, number_trouble, plain_value

BOUNDS: Mapping[str, tuple[str, str]] = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
    "multiple_of": ("a multiple of", "multiple_of"),
}
"""The words before a bound, and where the error has the bound."""
EXPECTED: Mapping[str, str] = {
    "string_type": "text",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a map of keys and values",
    "model_type": "a map of keys and values",
    "model_attributes_type": "a map of keys and values",
    "dataclass_type": "a map of keys and values",
}
"""What a value must be."""


def place_of(node: tree.TreeNode, error: ErrorDetails) -> tree.KeyPath:
    """Return the place of an error in the tree, without pydantic's own steps, such as members of a union."""
    found: tree.KeyPath = ()
    for step in error["loc"]:
        if tree.at(node, (*found, step)) is not None:
            found = (*found, step)
    if error["type"] == "missing":
        found = (*found, error["loc"][-1])
    return found


def repaired(data: Any, error: ErrorDetails, node: tree.TreeNode) -> Any:
    """Return `data` with one value converted to what a strict field requires: a number to text, a list to a tuple."""
    path, convert = place_of(node, error), _REPAIRS.get(error["type"])
    if convert is None:
        return data
    try:
        return changed(data, path, lambda value: convert(value, tree.at(node, path)))
    except (KeyError, IndexError, TypeError):  # the place is not in the data, such as a missing key
        return data


def changed(data: Any, path: tree.KeyPath, convert: Callable[[object], object]) -> Any:
    """Return `data` with the value at `path` converted; the same object if the value stays the same."""
    if not path:
        return convert(data)
    key = path[0]
    inner = changed(data[key], path[1:], convert)
    if inner is data[key]:
        return data
    if isinstance(data, dict):
        return {**data, key: inner}
    return type(data)(inner if index == key else item for index, item in enumerate(data))


def _as_text(value: object, node: tree.TreeNode | None) -> object:
    if isinstance(value, Quantity):
        return format_quantity(value.value, value.dimension)
    if isinstance(node, tree.ScalarNode) and node.filled is None and value is not None:
        return node.text
    return str(value) if isinstance(value, int | float) else value


def _as_tuple(value: object, _node: tree.TreeNode | None) -> object:
    return tuple(value) if isinstance(value, list) else value


_REPAIRS: dict[str, Callable[[object, tree.TreeNode | None], object]] = {
    "string_type": _as_text,
    "tuple_type": _as_tuple,
}


def about_key(model: Any, loc: tree.KeyPath) -> str:
    """Return what the key at `loc` below a model is for, as words that follow its name; empty if that is not known."""
    from rbxcompose.base.config import field_docs  # reads source files

    docs = (field_docs(cls).get(str(loc[-1]), "") for cls in models_at(model, loc[:-1]))
    about = next((text.partition(";")[0].partition(". ")[0].rstrip(".") for text in docs if text), "")
    return f": {about[:1].lower()}{about[1:]}".replace("`", "'") if about else ""


def _key_above(model: Any, loc: tree.KeyPath, node: tree.TreeNode | None) -> str:
    """Return the key whose named entries the map `node`, at the unknown key `loc`, looks like one of; else nothing."""
    if not isinstance(node, tree.MappingNode) or not node.entries:
        return ""
    fields = (pair for cls in models_at(model, loc[:-1]) for pair in field_types(cls).items())
    maps = ((name, one) for name, hint in fields for one in alternatives(hint) if get_origin(one) is dict)
    return next((name for name, one in maps if node.entries.keys() & {*keys_at(get_args(one)[1], ())}), "")


def with_cure(
    finding: Finding, model: Any, loc: tree.KeyPath, node: tree.TreeNode | None, absent: Sequence[str]
) -> tuple[Finding, str]:
    """Return the finding about an unknown key at `loc` with what to do, and the key that was meant instead, if any.

    `absent` are keys that its map needs and does not have.
    """
    if above := _key_above(model, loc, node):
        return replace(finding, help=f"write it below '{above}:', one level deeper", fix=None), above
    if len(absent) == 1 and not finding.help.startswith(DID_YOU_MEAN):
        about = about_key(model, (*loc[:-1], absent[0]))
        return replace(finding, help=f"write '{absent[0]}: ...' instead, which is needed{about}", fix=None), absent[0]
    return finding, ""


def written_deeper(node: tree.TreeNode, loc: tree.KeyPath) -> set[tree.KeyPath]:
    """Return where the keys below the unknown key at `loc` would be one level higher."""
    below = tree.at(node, loc)
    return {(*loc[:-1], key) for key in below.entries} if isinstance(below, tree.MappingNode) else set()


def in_straight_quotes(finding: Finding, node: tree.TreeNode | None) -> Finding:
    """Return the finding about a refused value; if it is in the quotes of books, with how to write those of YAML."""
    text = node.text if isinstance(node, tree.ScalarNode) and node.plain else ""
    if len(text) < len("''") or text[0] not in CURLY_QUOTES or text[-1] not in CURLY_QUOTES:
        return finding
    right = f'"{text.strip(CURLY_QUOTES)}"'
    return replace(
        finding,
        help=f"quotes are straight: write '{plain(right, 60)}'",
        fix=replacement(finding.span, text, right) if finding.span else None,
    )


def help_of_form(model: Any, loc: tree.KeyPath, value: tree.TreeNode | None, error: str) -> str:
    """Return the help for a value at `loc` below `model` that pydantic refuses with this error; nothing for most."""
    if EXPECTED.get(error) == EXPECTED["model_type"] and isinstance(value, tree.SequenceNode):
        return _as_map(model, loc, value) or (_with_keys(model, loc) if loc else "")
    if EXPECTED.get(error) == EXPECTED["model_type"] and loc and not is_empty(value):
        return _with_keys(model, loc)
    if EXPECTED.get(error) == EXPECTED["model_type"] and is_empty(value):
        name = f"'{loc[-1]}: !remove'" if loc else "'!remove' behind the colon"
        return f"write its keys below it; in a profile or an overlay, {name} removes it"
    if not isinstance(value, tree.ScalarNode) or not loc:
        return ""
    if isinstance(value.filled, Secret):
        return "a secret may stand only in settings that hide it; what is not secret is '${env.NAME}', or written here"
    return _without_unit(model, loc, value) if error.startswith("int_") else ""


def _with_keys(model: Any, loc: tree.KeyPath) -> str:
    """Return what a map with the keys looks like that it needs; nothing if it needs none, or there are several."""
    models = models_at(model, loc)
    fields = models[0].model_fields.items() if len(models) == 1 else ()
    needed = ", ".join(f"{one.alias or name}: ..." for name, one in fields if one.is_required())
    return f"write '{loc[-1]}: {{{needed}}}'" if needed else ""


def _as_map(model: Any, loc: tree.KeyPath, value: tree.SequenceNode) -> str:
    """Return a list of values as a map, in the order of the keys; nothing if there may be other keys."""
    models, words = models_at(model, loc), [item.text for item in value.items if isinstance(item, tree.ScalarNode)]
    names = list(models[0].model_fields) if len(models) == 1 else []
    if not words or len(words) != len(value.items) or len(words) > len(names):
        return ""
    shown = plain(", ".join(f"{name}: {word}" for name, word in zip(names, words, strict=False)), 200)
    return f"write each value with its key: '{{{shown}}}'"


def _without_unit(model: Any, loc: tree.KeyPath, value: tree.ScalarNode) -> str:
    """Return what a number without a unit counts, if one with a unit is written."""
    try:
        if parse_quantity(value.text).dimension == NUMBER:
            return ""
    except UnitError:
        return ""
    return f"write a number without a unit{about_key(model, loc)}"


UNKNOWN_KEY = kind("RBX1001", is_fixable=True)
MISSING_KEY = kind("RBX1002", is_fixable=True)
WRONG_TYPE = kind("RBX1003", is_fixable=True)
NOT_A_CHOICE = kind("RBX1004", is_fixable=True)
OUT_OF_RANGE = kind("RBX1005")
BAD_NAME = kind("RBX1006")

T = TypeVar("T")
KEYS = "keys that it takes"
ENTRY_WORDS: dict[str, str] = {}
"""What an entry of a section is called: each section that is declared enters its own."""
_MOST_FINDINGS = 100  # of one part: nobody makes more by mistake, and each costs a search for the nearest name
_OF_A_MAP = ("missing", "extra_forbidden")  # errors about a key that its map lacks or should not have
_ROUNDS = 8  # of repairs; each round goes at least one level deeper into a value


def to_plain(node: tree.TreeNode) -> object:
    """Return plain data: scalars by YAML's core types, filled ones with their typed value, maps and lists of these."""
    match node:
        case tree.ScalarNode(filled=None):
            return plain_value(node)
        case tree.ScalarNode():
            return node.filled
        case tree.SequenceNode(items=items):
            return [to_plain(item) for item in items]
        case tree.MappingNode(entries=entries):
            return {name: to_plain(entry.value) for name, entry in entries.items()}


@cache
def validator(model: Any) -> SchemaValidator:
    """Return what validates against a model, without the layer of Python that `TypeAdapter` has around it."""
    adapter = TypeAdapter(model)
    adapter.rebuild()  # else a model that is built late leaves a stand-in here, which looks for it in each call
    return cast(SchemaValidator, adapter.validator)


def is_valid(model: Any, data: object) -> bool:
    """Return whether `model` accepts plain data, without reasons."""
    try:
        validator(model).validate_python(data, strict=True)
    except ValidationError:
        return False
    return True


def validate(
    model: type[T],
    node: tree.TreeNode,
    path: tree.KeyPath,
    report: Report,
    context: Mapping[str, object] | None = None,
    *,
    also: Iterable[str] = (),
) -> T | None:
    """Return the node as an instance of `model` (any type that pydantic knows), or None after its findings.

    Nothing is converted: text is not a number, and `yes` is not a flag; only a text field accepts a number, as it is
    written. `path` is the path of `node` in its file, for the wording; `context` is what the model's validators need;
    `also` are keys allowed beside the model's own, which an unknown key may be a misspelling of.
    """
    data = to_plain(node)
    for _ in range(_ROUNDS):
        try:
            return cast(T, validator(cast(Any, model)).validate_python(data, strict=True, context=context))
        except ValidationError as error:
            errors = error.errors(include_url=False)
        before = data
        for details in errors:
            data = repaired(data, details, node)
        if data is before:
            break
    report.extend(islice(_findings(model, node, path, errors, tuple(also)), _MOST_FINDINGS))
    return None


def refusals(
    model: Any, error: ValidationError, root: tree.TreeNode, path: tree.KeyPath, places: Mapping[str, tree.KeyPath]
) -> Iterator[Finding]:
    """Turn the errors about what was made of the value at `path` of a manifest into findings.

    `places` are where `root` has what was made of other values, by field.
    """
    for details in error.errors(include_url=False):
        loc = details["loc"]
        there = (*places.get(str(loc[0]), (*path, loc[0])), *loc[1:]) if loc else path
        yield _finding(model, tree.MappingNode(span=tree.value_span(root, there)), path, loc, details)


def _findings(
    model: Any, node: tree.TreeNode, path: tree.KeyPath, errors: list[ErrorDetails], also: tuple[str, ...]
) -> Iterator[Finding]:
    """Turn pydantic's errors into findings: one for each place, none for what was reported before."""
    located = [(place_of(node, error), error) for error in errors]
    lacking = {loc for loc, error in located if error["type"] == "missing"}
    said: set[tree.KeyPath] = set()
    for loc, error in located:
        if error["type"] == "extra_forbidden":
            known = [*keys_at(model, loc[:-1]), *(() if len(loc) > 1 else also)]
            finding, meant = _unknown_key(known, node, path, loc, lacking)
            slip = _slip(model, node, path, loc, error, finding, known)
            if not slip and not meant:
                absent = [str(key_path[-1]) for key_path in lacking - said if key_path[:-1] == loc[:-1]]
                finding, meant = with_cure(finding, model, loc, tree.at(node, loc), absent)
            said |= {loc, (*loc[:-1], meant), *(written_deeper(node, loc) & lacking)}  # these are not missing as well
            yield slip or finding
    for loc, error in located:
        if loc not in said and not is_broken(tree.at(node, loc)):
            said.add(loc)
            finding = in_straight_quotes(_finding(model, node, path, loc, error), tree.at(node, loc))
            keys = keys_at(model, loc) if error["type"].startswith("model") else ()
            yield _slip(model, node, path, loc, error, finding, keys) or finding


def where(path: tree.KeyPath) -> str:
    """Return the name of a map at `path`: "component 'gui'", "'inputs.teleop' of mux 'cmd_vel'"."""
    match path:
        case ():
            return "this file"
        case (str(section), name) if section in ENTRY_WORDS:
            return f"{ENTRY_WORDS[section]} '{name}'"
        case (str(section), name, *below) if section in ENTRY_WORDS:
            return f"'{'.'.join(map(str, below))}' of {ENTRY_WORDS[section]} '{name}'"
    return f"'{'.'.join(map(str, path))}'"


def _unknown_key(
    known: Iterable[str], node: tree.TreeNode, path: tree.KeyPath, loc: tree.KeyPath, lacking: set[tree.KeyPath]
) -> tuple[Finding, str]:
    """Return the finding for an unknown key, and the missing key that it misspells, if any."""
    key = str(loc[-1])
    missing = [str(place[-1]) for place in lacking if place[:-1] == loc[:-1]]
    is_foreign = FOREIGN.get(key) in missing
    meant = [FOREIGN[key]] if is_foreign else get_close_matches(key, missing, n=1, cutoff=SIMILAR)
    message = f"unknown key '{plain(key, 60)}' in {where((*path, *loc[:-1]))}"
    taken = tree.entries_of(tree.at(node, loc[:-1]))
    finding = UNKNOWN_KEY.misspelt(tree.key_span(node, loc), message, key, meant or known, KEYS, taken=taken)
    return finding, meant[0] if meant else ""


def _finding(model: Any, node: tree.TreeNode, path: tree.KeyPath, loc: tree.KeyPath, error: ErrorDetails) -> Finding:
    name = _called((*path, *loc))
    value = tree.at(node, loc)
    context = error.get("ctx", {})
    span = tree.value_span(node, loc)
    is_key = error["loc"][-1:] == ("[key]",)
    place = tree.key_span(node, loc) if is_key else span
    choices = ["".join(choice) for choice in re.findall(r"'([^']*)'|(\d+)", str(context.get("expected", "")))]
    if is_key and choices:
        return _unknown_key(choices, node, path, loc, set())[0]
    is_misnamed = error["type"] == "string_pattern_mismatch" or (is_key and "long" not in error["type"])
    if "valid" not in context and is_misnamed:
        text = value.text if isinstance(value, tree.ScalarNode) and place is span else name
        help_text = "lower-case letters, digits and underscores, starting with a letter"
        near = re.sub(r"\W+", "_", text.strip("/ ")).lower()  # ROS 1 began names of topics with a slash
        help_text += f", such as '{near}'" if re.fullmatch(r"[a-z][a-z0-9_]{0,59}", near) else ""
        return BAD_NAME.at(place, f"'{text}' is not a valid name", help=str(context.get("help", help_text)))
    match error["type"]:
        case "missing" if loc and isinstance(loc[-1], int):
            return WRONG_TYPE.at(tree.value_span(node, loc[:-1]), f"{where((*path, *loc[:-1]))} needs another item")
        case "missing":
            message, about = f"{where((*path, *loc[:-1]))} needs the key '{name}'", about_key(model, loc)
            return MISSING_KEY.at(tree.key_span(node, loc[:-1]), message, help=f"add '{name}: ...'{about}")
        case "literal_error" | "enum":
            return not_a_choice(span, name, value, choices)
        case "value_error" if isinstance(cause := context.get("error"), UnitError):
            return unit_finding(cause, value or node, name)
        case "unreadable":
            return UNREADABLE.at(span, error["msg"])
        case "value_error":
            return WRONG_TYPE.at(span, f"'{name}': {context.get('error')}")
        case "string_too_long" | "too_long" | "string_too_short" | "too_short":
            words, key = ("at most", "max_length") if "long" in error["type"] else ("at least", "min_length")
            one, more = ("character", "characters") if "string" in error["type"] else ("entry", "entries")
            size = context[key]
            return OUT_OF_RANGE.at(place, f"'{name}' must have {words} {size} {one if size == 1 else more}")
        case kind_of_error if kind_of_error in BOUNDS:
            words, key = BOUNDS[kind_of_error]
            dimension = dimension_at(model, loc)
            bound = format_quantity(context[key], dimension) if dimension else context[key]
            return OUT_OF_RANGE.at(span, f"'{name}' must be {words} {bound}")
        case kind_of_error if kind_of_error in EXPECTED:
            message = f"'{name}' must be {EXPECTED[kind_of_error]}"
            help_text = help_of_form(model, loc, value, kind_of_error)
            return WRONG_TYPE.at(span, message, label=label_of(value), help=help_text)
    if "valid" in context:  # a validator of ours that supplies the valid names
        message = error["msg"] if is_key else f"'{name}': {error['msg']}"
        return NOT_A_CHOICE.misspelt(place, message, context["name"], context["valid"], context["what"])
    if "about" in context:  # or the names that it lacks
        return WRONG_TYPE.at(span, f"'{name}': {error['msg']}", about=context["about"])
    if "help" in context:  # or its own help
        named = [str(context.get("name", ""))]
        return NOT_A_CHOICE.at(span, f"'{name}': {error['msg']}", help=str(context["help"]), about=named)
    return WRONG_TYPE.at(span, f"'{name}': {error['msg'][:1].lower()}{error['msg'][1:]}", label=label_of(value))


def not_a_choice(span: Span, name: str, value: tree.TreeNode | None, choices: list[str]) -> Finding:
    """Return the finding for a value that is not one of the few words that its key accepts."""
    written = str(value.text if value.filled is None else value.filled) if isinstance(value, tree.ScalarNode) else ""
    if (ours := FOREIGN_CHOICES.get(written)) in choices:
        message = f"'{name}' must be one of {', '.join(choices)}"
        return NOT_A_CHOICE.at(span, message, help=f"{DID_YOU_MEAN} '{ours}'?")
    if len(choices) == 1:
        label = "" if written else label_of(value)
        fix = correction(written, choices, span)
        return NOT_A_CHOICE.at(span, f"'{name}' must be '{choices[0]}'", label=label, fix=fix)
    finding = NOT_A_CHOICE.misspelt(span, f"'{name}' must be one of {', '.join(choices)}", written, choices)
    is_near = finding.help.startswith(DID_YOU_MEAN)
    return finding if is_near else replace(finding, help="")  # the message lists all of them


def _called(path: tree.KeyPath) -> str:
    """Return the name of a value: its key, or its list and index."""
    *above, last = path or ("this file",)
    return f"{above[-1]}[{last}]" if isinstance(last, int) and above else str(last)


def is_broken(node: tree.TreeNode | None) -> bool:
    """Return whether a value could not be filled in or is a rejected number, both of which were reported."""
    return isinstance(node, tree.ScalarNode) and (
        node.filled is tree.BROKEN or (node.filled is None and bool(number_trouble(node)))
    )


def label_of(node: tree.TreeNode | None) -> str:
    """Return what a node is, for the label of a finding: "this is text"."""
    if isinstance(node, tree.ScalarNode) and isinstance(node.filled, Quantity):
        return f"this is {node.filled.dimension.phrase}"
    if isinstance(node, tree.ScalarNode) and node.filled is None and " " in node.text:
        with suppress(UnitError):
            return f"this is {parse_quantity(node.text).dimension.phrase}"
    return describe(to_plain(node)) if node is not None else ""


def unit_finding(error: UnitError, node: tree.TreeNode, name: str) -> Finding:
    """Return the finding for a value that is not the required quantity."""
    # If it does not even look like a number, what is wrong with the number is no use.
    is_word = isinstance(node, tree.ScalarNode) and node.filled is None and node.text[:1] not in "+-.0123456789"
    label = label_of(node) if is_word or not error.detail else error.detail
    return WRONG_TYPE.at(node.span, f"'{name}' {error.message}", label=label, help=error.help)


def _slip(
    model: Any,
    node: tree.TreeNode,
    path: tree.KeyPath,
    loc: tree.KeyPath,
    error: ErrorDetails,
    finding: Finding,
    keys: Sequence[str] = (),
) -> Finding | None:
    """Return the finding about a slip, if the model accepts what was probably meant."""
    refused_at = loc[:-1] if error["type"] in _OF_A_MAP else loc
    written = tree.at(node, refused_at)
    if written is None:
        return None
    for slip in value_slip.at(error["type"]):
        repair = slip(RefusedValue((*path, *loc), finding, keys), written)
        if repair and _takes(model, _with(to_plain(node), refused_at, to_plain(repair.node)), loc):
            return repair.findings[0]
    return None


def _with(data: object, path: tree.KeyPath, value: object) -> object:
    return changed(data, path, lambda _: value)


def _takes(model: Any, data: object, loc: tree.KeyPath) -> bool:
    """Return whether a model accepts the value at `loc`."""
    try:
        validator(model).validate_python(data)
    except ValidationError as error:
        return not any(entry["loc"][: len(loc)] == loc for entry in error.errors(include_url=False))
    return True


_SALVAGE_ROUNDS = 60  # of repairs; each replaces, at every place that is refused, one value by the next stand-in
_ABSENT = object()
_NOWHERE = Place("nowhere", 0.0, 0.0, 0.0)
_STAND_INS: tuple[object, ...] = (1, 1.0, "unknown", False, {}, [], _NOWHERE)


def salvaged(model: type[T], node: TreeNode, context: Mapping[str, object] | None = None) -> T | None:
    """Return a node with mistakes as an instance of `model`, None if too little of it can be read.

    What is unknown or wrong is left out, so that it has its default; what must be there gets a stand-in, some value
    that the model accepts. Nothing is reported: that was done by `validate`. Nobody may conclude anything from a
    value that is in doubt; see `rbxcompose/compiler/doubts.py`.
    """
    data, tried = to_plain(node), Counter[KeyPath]()
    for _ in range(_SALVAGE_ROUNDS):
        try:
            return cast(T, validator(cast(Any, model)).validate_python(data, strict=True, context=context))
        except ValidationError as error:
            errors = error.errors(include_url=False)
        for details in errors:
            before = data
            data = repaired(data, details, node)
            if data is before:
                data = _mended(model, data, details, tried)
        if not isinstance(data, dict):
            return None
    return None


def _mended(model: Any, data: object, error: ErrorDetails, tried: Counter[KeyPath]) -> object:
    """Return the data without the refused value, or with the next stand-in for it; without what holds it, if none fits.

    An item of a list is replaced at once, because the places of those after it must not change.
    """
    path = _place(data, error)
    if not path:
        return _ABSENT
    is_short = error["type"] == "missing" and isinstance(path[-1], int)  # a list that needs another item
    if is_short or error["type"] == "extra_forbidden" or error["loc"][-1:] == ("[key]",):
        return _without(data, path)
    is_first = path not in tried
    tried[path] += 0
    if is_first and error["type"] != "missing" and not isinstance(path[-1], int):
        return _without(data, path)
    number, stand_ins = tried[path], _stand_ins(model, path, error)
    tried[path] += 1
    if number < len(stand_ins):
        return _put(data, path, stand_ins[number])
    return _ABSENT if len(path) == 1 else _without(data, path[:-1])


def _stand_ins(model: Any, path: KeyPath, error: ErrorDetails) -> list[object]:
    dimension = dimension_at(model, path)
    words = re.findall(r"'([^']*)'", str(error.get("ctx", {}).get("expected", "")))
    measured = [Quantity(1.0, dimension)] if dimension else []
    return [*measured, *words[:1], *_STAND_INS]


def _place(data: object, error: ErrorDetails) -> KeyPath:
    """Return the place of an error in the data, without pydantic's own steps, such as members of a union."""
    found: KeyPath = ()
    for step in error["loc"]:
        below = _below(data, step)
        if below is not _ABSENT:
            found, data = (*found, step), below
    return (*found, error["loc"][-1]) if error["type"] == "missing" else found


def _below(data: object, key: str | int) -> object:
    match data:
        case dict():
            return data.get(key, _ABSENT)
        case list() | tuple() if isinstance(key, int) and key < len(data):
            return data[key]
    return _ABSENT


def _without(data: object, path: KeyPath) -> object:
    *above, last = path
    if isinstance(last, int):
        return _ABSENT if not above else _without(data, tuple(above))
    return changed(data, tuple(above), lambda around: _left(around, last))


def _left(around: object, key: str) -> object:
    return {name: value for name, value in around.items() if name != key} if isinstance(around, dict) else around


def _put(data: object, path: KeyPath, value: object) -> object:
    *above, last = path
    if isinstance(last, int):
        return changed(data, path, lambda _: value)
    return changed(data, tuple(above), lambda around: {**around, last: value} if isinstance(around, dict) else around)
