"""The core types of YAML 1.2: what a scalar without quotes means (`on`, `yes` and `12:30` are text)."""

import math
import re

from rbxcompose.manifest.tree import NUMBER, ScalarNode, TreeNode

PlainValue = bool | int | float | str | None

_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_NUMBER = re.compile(
    r"(?P<decimal>[-+]?[0-9]+)|(?P<based>0o[0-7]+|0x[0-9a-fA-F]+)"
    r"|(?P<float>[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)"
    r"|(?P<infinite>[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))"
)
_MAY_BE_NUMBER = frozenset("+-.0123456789")


def plain_value(scalar: ScalarNode) -> PlainValue:
    """Return the value of a scalar by YAML's core types; a number that `number_trouble` names stays text."""
    text = scalar.text
    if not scalar.plain:
        return text
    if text[:1] not in _MAY_BE_NUMBER:
        return _WORDS.get(text, text)
    form = _number_form(text)
    if not form or _trouble(text, form):
        return text
    if form == "float":
        return float(text)
    return int(text) if form == "decimal" else int(text, 0)


def is_empty(node: TreeNode | None) -> bool:
    """Return whether nothing is written there, in one of YAML's ways: `start:`, `start: null`, `start: ~`."""
    return isinstance(node, ScalarNode) and node.plain and _WORDS.get(node.text, False) is None


def number_trouble(scalar: ScalarNode) -> str:
    """Return why the number in a scalar is rejected, worded to follow "this number"; empty if it is not."""
    if scalar.text[:1] not in _MAY_BE_NUMBER or not scalar.plain:
        return ""
    form = _number_form(scalar.text)
    return _trouble(scalar.text, form) if form else ""


def _number_form(text: str) -> str:
    """Return the form of a number in a text (a group of `_NUMBER`), empty if it is not a number."""
    match = _NUMBER.fullmatch(text)
    return match.lastgroup or "" if match else ""


def _trouble(text: str, form: str) -> str:
    if form == "infinite":
        return "is not finite"
    if len(text) > NUMBER:
        return f"has {len(text):,} characters, {NUMBER} are the limit"
    return "is too large" if form == "float" and not math.isfinite(float(text)) else ""


def describe(value: object) -> str:
    """Return a description of a plain value: "this is text"."""
    match value:
        case None:
            return "this is empty"
        case bool():
            return "this is true or false"
        case int() | float():
            return "this is a number"
        case str():
            return "this is text"
        case dict():
            return "this is a map"
        case list() | tuple():
            return "this is a list"
    return "this is another type of value"
