"""A plug-in of ours is one file, which declares what its name says; no two have the same name."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import pytest

from rbxcompose.base.plugins import BrokenPluginError, Plugins, domain_of
from rbxcompose.commands.importing import importer
from rbxcompose.domains.servos import bus, controller
from rbxcompose.manifest.registry import PLUGINS as SECTIONS
from rbxcompose.manifest.registry import sections
from rbxcompose.sdk import registry
from tests.project.package import PACKAGE, files

FAMILIES = (
    "bus_types",
    "commands",
    "components",
    "controllers",
    "examinations",
    "formats",
    "importers",
    "sections",
    "skills",
)


def declared() -> Iterator[tuple[Plugins, dict[str, str]]]:
    """Yield each family whose plug-ins have names of their own: its plug-ins, and where each name is declared."""
    yield registry.PLUGINS, {name: registry.component_type(name).__module__ for name in registry.PLUGINS.shipped}
    skills = registry.SKILL_PLUGINS
    yield skills, {name: registry.skill_type(name).make.__module__ for name in skills.shipped}
    yield controller.PLUGINS, {name: controller.controller_type(name).__module__ for name in controller.PLUGINS.shipped}
    yield bus.PLUGINS, {name: bus.bus_type(name).open.__module__ for name in bus.PLUGINS.shipped}
    yield importer.PLUGINS, {name: one.run.__module__ for name, one in importer.importers().items()}


def test_each_file_declares_what_its_name_says() -> None:
    assert [plugins.family for plugins, found in declared() if found != plugins.shipped] == []


def test_each_section_of_a_domain_is_in_the_file_of_its_name() -> None:
    found = {one.name: one.read.__module__ for one in sections()}
    in_domains = {name: module for name, module in SECTIONS.shipped.items() if domain_of(module)}
    assert {name: module for name, module in found.items() if domain_of(module)} == in_domains


def test_no_two_plug_ins_of_a_family_have_the_same_name() -> None:
    places: dict[tuple[str, str], list[str]] = defaultdict(list)
    for path in (path for path in files() if path.stem != "__init__"):
        room, family = path.parent.parent, path.parent.name
        if room != PACKAGE and family in FAMILIES:
            places[family, path.stem].append(room.name)
    assert {name: rooms for name, rooms in places.items() if len(rooms) > 1} == {}


def test_a_file_that_declares_something_else_is_named() -> None:
    plugins = Plugins("component", "components")
    plugins.shipped = {"barometer": "rbxcompose.sdk.registry"}
    sentence = r"the component 'barometer' of rbxcompose cannot be used: its module declares no class by @component"
    with pytest.raises(BrokenPluginError, match=sentence):
        plugins.find("barometer", {}, "class by @component('barometer')")
