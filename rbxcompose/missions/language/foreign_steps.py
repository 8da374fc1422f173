"""Steps in the words of other languages."""

from __future__ import annotations

from collections.abc import Mapping

_OURS = {
    "fallback": "selector sel priority_selector",
    "sequence": "seq steps sequential",
    "parallel": "par simultaneously together concurrently",
    "repeat": "loop",
    "for": "foreach for_each",
    "wait": "sleep delay pause",
    "choose": "switch match case",
    "log": "print echo",
    "use": "subtree sub_tree submission include",
    "run": "exec script",
    "end": "return stop exit abort terminate",
    "wait_for": "wait_until await wait_template wait_for_trigger",
}
FOREIGN: Mapping[str, str] = {name: ours for ours, names in _OURS.items() for name in names.split()}
"""Our word for each of another mission language or of a behaviour tree."""

OUTCOMES: Mapping[str, str] = {
    **dict.fromkeys(("succeeded", "succeed", "succeeds", "done", "ok", "true"), "success"),
    **dict.fromkeys(("aborted", "failed", "fail", "fails", "error", "preempted", "canceled", "false"), "failure"),
}
"""Our outcome for each of other mission languages."""
