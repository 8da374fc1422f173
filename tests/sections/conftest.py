"""The toy section, as long as the tests of one file run: the schemas with it are made once."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from typing import Any, cast

import pytest

from rbxcompose.compiler.schema.documents import schema_with
from rbxcompose.manifest import registry
from rbxcompose.manifest.section import Section
from rbxcompose.manifest.validate import ENTRY_WORDS
from rbxcompose.sdk import registry as types


@pytest.fixture(scope="module")
def lamps() -> Iterator[Section[Any, Any]]:
    """Declare the section `lamps`, and forget it when the tests end."""
    types.usable_names()
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(registry, "_SECTIONS", {section.name: section for section in registry.sections()})
        monkeypatch.setattr(types, "_TYPES", dict(types._TYPES))
        monkeypatch.setitem(ENTRY_WORDS, "lamps", "lamp")
        monkeypatch.delitem(sys.modules, "tests.sections.toy", raising=False)
        schema_with.cache_clear()
        yield cast(Section[Any, Any], importlib.import_module("tests.sections.toy").lamps)
    schema_with.cache_clear()
