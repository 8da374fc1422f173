"""Sections are found by their names, also those of other packages."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rbxcompose.base.config import Config
from rbxcompose.base.plugins import Plugins
from rbxcompose.manifest import registry
from rbxcompose.manifest.registry import section, sections
from rbxcompose.manifest.section import Reading
from rbxcompose.testing import Checked, check_text
from tests.third_party.places import put

SECTION = '''\
from rbxcompose.base.config import Config
from rbxcompose.manifest.registry import section


class Horn(Config):
    loudness: int = 0


@section("horn", Horn)
def horn(reading):
    """How loud it hoots."""
    return reading.whole()
'''
ROBOT = "rbx: 1\nkind: Robot\nname: one\n"
Install = Callable[[str, str], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Give a function that installs a module as a section of a name, until the test ends."""
    monkeypatch.setattr(registry, "_SECTIONS", {one.name: one for one in sections()})

    def give(name: str, text: str) -> None:
        put(tmp_path, "horns", {f"section.{name}": "horn_module"}, {"horn_module.py": text})
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.delitem(sys.modules, "horn_module", raising=False)
        monkeypatch.setattr(registry, "PLUGINS", Plugins("section", "sections"))
        registry._problems.cache_clear()

    yield give
    registry._problems.cache_clear()


def checked(folder: Path, text: str) -> Checked:
    return check_text(ROBOT + text, folder / "robots/one")


def test_a_section_of_another_package_is_one_of_the_manifest(install: Install, tmp_path: Path) -> None:
    install("horn", SECTION)
    made = checked(tmp_path, "horn: {loudnes: 3}\n")
    assert "unknown key 'loudnes' in 'horn'" in made.text
    assert not checked(tmp_path, "horn: {loudness: 3}\n").compilation.report.has_errors


def test_a_file_of_ours_takes_no_name_from_others(install: Install, tmp_path: Path) -> None:
    install("composition", SECTION.replace('"horn", ', '"composition", '))
    assert not checked(tmp_path, "composition: {loudness: 3}\n").compilation.report.has_errors


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("horn", "import no_such_module", "the section 'horn' of package 'horns' cannot be used: ModuleNotFoundError"),
        ("bus", SECTION, "the section 'bus' of package 'horns' is left out: rbxcompose has one of this name"),
        ("args", SECTION, "the section 'args' of package 'horns' is left out: rbxcompose has one of this name"),
        ("horn", SECTION.replace('"horn", ', '"bus", '), "ValueError: two sections are named 'bus'"),
        ("horn", SECTION.replace('"""How loud it hoots."""', ""), "the section 'horn' has no docstring"),
    ],
)
def test_one_that_cannot_be_used_is_left_out_and_told(
    install: Install, tmp_path: Path, name: str, text: str, told: str
) -> None:
    install(name, text)
    made = checked(tmp_path, "bus: {domain: 3}\n")
    assert "RBX9302" in made.text
    assert told in made.text
    assert not made.compilation.report.has_errors


def test_a_section_has_words_for_who_reads_of_it() -> None:
    def without_words(reading: Reading[Config]) -> None: ...

    with pytest.raises(ValueError, match="no docstring"):
        section("horn", Config)(without_words)


def test_every_section_tells_what_it_is_for() -> None:
    assert [one.name for one in sections() if not one.doc.endswith(".")] == []
