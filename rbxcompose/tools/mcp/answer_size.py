"""Answers of a limited size, which say what was left out."""

from __future__ import annotations

import json
from typing import Any

MOST_CHARACTERS = 40_000  # of a whole answer, as JSON
MOST_ITEMS = 200  # of a list
MOST_TEXT = 20_000  # characters of one text
_DEEPEST = 20
CUT = "left_out"
"""The key under which an answer says what it lacks."""


def limited(data: dict[str, Any], most: int = MOST_CHARACTERS) -> dict[str, Any]:
    """Return an answer that has at most `most` characters as JSON: lists lose their ends, texts what is behind."""
    items, text = MOST_ITEMS, MOST_TEXT
    while True:
        cut: list[str] = []
        shown = _cut(data, "", items, text, cut, _DEEPEST)
        shown = {**shown, CUT: cut[:MOST_ITEMS]} if cut else shown
        if len(json.dumps(shown, ensure_ascii=False)) <= most:
            return dict(shown)
        if items == 1 and text == 1:
            return {CUT: [f"the answer has more than {most:,} characters"]}
        items, text = max(1, items // 2), max(1, text // 2)


def _cut(value: Any, name: str, items: int, text: int, cut: list[str], depth: int) -> Any:
    match value:
        case str() if len(value) > text:
            cut.append(f"{name}: {len(value) - text:,} of {len(value):,} characters")
            return value[:text]
        case dict() | list() if not depth:
            cut.append(f"{name}: what is nested deeper")
            return None
        case dict():
            if len(value) > items:
                cut.append(f"{name}: {len(value) - items:,} of {len(value):,} entries")
            some = list(value.items())[:items]
            return {key: _cut(entry, f"{name}.{key}".lstrip("."), items, text, cut, depth - 1) for key, entry in some}
        case list():
            if len(value) > items:
                cut.append(f"{name}: {len(value) - items:,} of {len(value):,} items")
            some = value[:items]
            return [_cut(item, f"{name}.{index}", items, text, cut, depth - 1) for index, item in enumerate(some)]
    return value
