"""xacro files: expanded with the places of their elements, fenced against what a description has no use for."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import pytest

from rbxcompose.base.findings import Finding, Span, one_compile
from rbxcompose.base.requests import to_data
from rbxcompose.domains.body import xacro as xacro_answers
from rbxcompose.domains.body.xacro import Expanded, XacroFile, expand_all
from rbxcompose.domains.body.xacro_answer import BareFile, BareTag, XacroAnswer, read_answer
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from tests.body.described import expand
from tests.loops import for_all
from tests.soak import rare

HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
TAG = BareTag(1, 2, "macro", (3, 4))
HERE = Span("robot.yaml", 5, 10, 5, 20)
MACROS = HEAD + (
    '  <xacro:macro name="wheel" params="side">\n    <link name="${side}_wheel"/>\n  </xacro:macro>\n</robot>\n'
)


def expanded(
    folder: Path, text: str, arguments: dict[str, str] | None = None, packages: dict[str, Path] | None = None
) -> tuple[Expanded | Finding, Sequence[Path]]:
    (folder / "r.xacro").write_text(text)
    return expand(folder / "r.xacro", arguments or {}, packages or {}, [folder], HERE)


def links(found: Expanded | Finding) -> list[tuple[str, str, int, int]]:
    assert isinstance(found, Expanded), found
    root = read_urdf(found.located, "r.xacro")
    assert isinstance(root, XmlElement), root
    return [
        (child.attributes["name"], Path(child.span.file).name, child.span.line, child.span.column)
        for child in root.children
    ]


def test_elements_keep_their_places_through_includes_and_macros(tmp_path: Path) -> None:
    (tmp_path / "wheel.xacro").write_text(MACROS)
    text = HEAD + '<xacro:include filename="wheel.xacro"/>\n<link name="base"/><xacro:wheel side="left"/>\n</robot>'
    found, files = expanded(tmp_path, text)
    assert links(found) == [("base", "r.xacro", 3, 1), ("left_wheel", "wheel.xacro", 3, 5)]
    assert [file.name for file in files] == ["r.xacro", "wheel.xacro"]
    assert isinstance(found, Expanded)
    assert "rbx-place" not in found.text
    assert '<link name="left_wheel"/>' in found.text


def test_arguments_and_packages_come_from_the_manifest(tmp_path: Path) -> None:
    (tmp_path / "vendor").mkdir()
    (tmp_path / "vendor/wheel.xacro").write_text(MACROS)
    text = HEAD + '<xacro:arg name="n" default="1"/><xacro:include filename="$(find wheels)/wheel.xacro"/>\n'
    text += '<xacro:wheel side="w${2 * $(arg n)}"/></robot>'
    found, _ = expanded(tmp_path, text, {"n": "4"}, {"wheels": tmp_path / "vendor"})
    assert links(found) == [("w8_wheel", "wheel.xacro", 3, 5)]


MISTAKES = {
    "an unknown name": ('<link name="${side}"/>', 3, "'side'"),
    "an unknown macro": ('<xacro:whel side="left"/>', 3, "unknown macro name: xacro:whel"),
    "a parameter that a macro does not have": ('<xacro:wheel sde="left"/>', 3, 'Invalid parameter "sde"'),
    "a missing parameter": ("<xacro:wheel/>", 3, "Undefined parameters [side]"),
    "a file that does not exist": ('<xacro:include filename="nothing.xacro"/>', 3, "cannot be read"),
    "an unknown package": ('<xacro:include filename="$(find nothing)/a.xacro"/>', 3, "package 'nothing' is not known"),
    "a condition": ('<a/>\n<xacro:if value="$(eval f(1)"/>', 4, "'(' was never closed"),
    "the default of an argument": ('<a/>\n<xacro:arg name="a" default="${1 +}"/>', 4, "invalid syntax"),
    "a condition in a macro": (
        '<xacro:macro name="m"><a/>\n<xacro:if value="x"/></xacro:macro>\n<xacro:m/>',
        4,
        "Xacro conditional",
    ),
    "the environment": ('<link name="$(env HOME)"/>', 3, "HOME"),
    "a file elsewhere": ('<xacro:include filename="/etc/passwd"/>', 3, "outside the project"),
    "YAML elsewhere": ("<link name=\"${xacro.load_yaml('/etc/passwd')}\"/>", 3, "only read files of its project"),
    "Python": (
        '<link name="${(lambda: [c for c in ().__class__.__base__.__subclasses__() '
        "if c.__name__ == 'Popen'][0](['touch', 'pwned']))()}\"/>",
        3,
        "",
    ),
    "a macro of its own": ('<xacro:macro name="a" params=""><xacro:a/><xacro:a/></xacro:macro><xacro:a/>', 0, ""),
    "a long sum": ('<link name="${sum(range(10 ** 12))}"/>', 0, ""),
    "much text": ("<link name=\"${'a' * 10 ** 12}\"/>", 0, ""),
}


ENDLESS = ("a macro of its own", "a long sum", "much text")
"""What ends the process that expands it."""


def write(folder: Path, name: str) -> None:
    (folder / "wheel.xacro").write_text(MACROS)
    (folder / "r.xacro").write_text(f'{HEAD}<xacro:include filename="wheel.xacro"/>\n{MISTAKES[name][0]}\n</robot>')


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, Expanded | Finding]]:
    """Return the folder of each mistake, and what came of it: all are expanded in one process."""
    folders: dict[str, Path] = {}
    names = [name for name in MISTAKES if name not in ENDLESS]
    for name in names:
        folders[name] = folder = tmp_path_factory.mktemp("mistake")
        write(folder, name)
    found = expand_all([XacroFile(folders[name] / "r.xacro", {}, {}, [folders[name]], HERE) for name in names])
    return {name: (folders[name], finding) for name, (finding, _) in zip(names, found, strict=True)}


def is_told(finding: Expanded | Finding, folder: Path, line: int, words: str) -> None:
    assert isinstance(finding, Finding)
    assert finding.code == "RBX2007"
    assert words in finding.message
    assert finding.span
    if line:
        assert finding.span.line == line
    assert {path.name for path in folder.iterdir()} == {"r.xacro", "wheel.xacro"}


@for_all("name", [name for name in MISTAKES if name not in ENDLESS])
def test_a_mistake_is_a_finding_at_its_place_and_nothing_is_executed(
    name: str, answered: dict[str, tuple[Path, Expanded | Finding]]
) -> None:
    folder, finding = answered[name]
    is_told(finding, folder, *MISTAKES[name][1:])


@pytest.mark.parametrize("name", ["a macro of its own", *rare("a long sum", "much text")])
def test_what_does_not_end_is_a_finding(name: str, tmp_path: Path) -> None:
    write(tmp_path, name)
    found, _ = expand(tmp_path / "r.xacro", {}, {}, [tmp_path], HERE)
    is_told(found, tmp_path, *MISTAKES[name][1:])


def test_a_file_is_expanded_again_only_when_something_that_it_used_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started = Mock(wraps=subprocess.Popen)
    monkeypatch.setattr(subprocess, "Popen", started)
    (tmp_path / "r.xacro").write_text(HEAD + '<xacro:include filename="parts/*.xacro"/></robot>')
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/a.xacro").write_text('<robot><link name="a"/></robot>')

    def links(height: str) -> int:
        found, _ = expand(tmp_path / "r.xacro", {"height": height}, {}, [tmp_path], HERE)
        assert isinstance(found, Expanded)
        return found.text.count("<link")

    assert [links(height) for height in ("1", "1", "2")] == [1, 1, 1]
    assert started.call_count == 2
    (tmp_path / "parts/a.xacro").write_text('<robot><link name="a"/><link name="b"/></robot>')
    assert (links("1"), links("1"), started.call_count) == (2, 2, 3)
    (tmp_path / "parts/b.xacro").write_text('<robot><link name="c"/></robot>')
    assert (links("1"), links("1"), started.call_count) == (3, 3, 4)


def test_what_does_not_end_is_tried_once_in_a_compile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started = Mock(wraps=subprocess.Popen)
    monkeypatch.setattr(subprocess, "Popen", started)
    (tmp_path / "r.xacro").write_text(HEAD + "${[x for x in range(10**12)]}</robot>")
    with one_compile():
        for _ in range(2):
            found, _ = expand(tmp_path / "r.xacro", {}, {}, [tmp_path], HERE)
            assert isinstance(found, Finding)
    assert started.call_count == 1


def test_what_is_no_xml_is_a_finding_at_its_line(tmp_path: Path) -> None:
    found, _ = expanded(tmp_path, HEAD + "<link>\n</robot>")
    assert isinstance(found, Finding)
    assert found.span
    assert (Path(found.span.file).name, found.span.line) == ("r.xacro", 3)
    refused, _ = expanded(tmp_path, '<!DOCTYPE robot [<!ENTITY a "b">]>' + HEAD + "</robot>")
    assert isinstance(refused, Finding)
    assert "DOCTYPE" in refused.message


FORGED = {
    "no answer": b"",
    "another type": b"[]",
    "no text": b'{"text": 1}',
    "deep": b"[" * 100_000,
    "other fields": b'{"answer": ""}',
    "a bare tag without a place": b'{"bare": {"/r.xacro": {"tags": [{"name": "a"}]}}}',
}


@pytest.mark.parametrize("name", FORGED)
def test_an_answer_of_another_shape_is_none(name: str) -> None:
    assert read_answer(FORGED[name], ["/"]) is None


def test_an_answer_about_files_elsewhere_is_not_believed() -> None:
    answer = XacroAnswer(("/a/r.xacro", "/b/r.xacro"), "", "no", "/b/r.xacro|1|1|1", {"/b/r.xacro": BareFile((TAG,))})
    assert read_answer(json.dumps(to_data(answer)).encode(), ["/a"]) == XacroAnswer(("/a/r.xacro",), "", "no")
    there = replace(answer, place="/a/r.xacro|1|1|1", files=("/a/r.xacro",), bare={"/a/r.xacro": BareFile((TAG,))})
    assert read_answer(json.dumps(to_data(there)).encode(), ["/a"]) == there
    for place in ("/a/r.xacro|0|1|1", "/a/r.xacro", "/a/r.xacro|1|1|99999999999"):
        found = read_answer(json.dumps(to_data(replace(there, place=place))).encode(), ["/a"])
        assert found == replace(there, place="")


def test_an_argument_that_no_file_declares_is_told_with_the_nearest(tmp_path: Path) -> None:
    declared = '<xacro:arg name="height" default="1"/>'
    (tmp_path / "r.xacro").write_text(f"{HEAD}{declared}</robot>")
    found, _ = expand(tmp_path / "r.xacro", {"heigth": "2"}, {}, [tmp_path], HERE)
    assert isinstance(found, Expanded)
    [note] = found.notes
    assert (note.code, note.help) == ("RBX2020", "did you mean 'height'?")
    fine, _ = expand(tmp_path / "r.xacro", {"height": "2"}, {}, [tmp_path], HERE)
    assert isinstance(fine, Expanded)
    assert fine.notes == ()


def test_what_was_expanded_is_kept_for_other_processes_but_not_from_other_users(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    started = Mock(wraps=subprocess.Popen)
    monkeypatch.setattr(subprocess, "Popen", started)
    (tmp_path / "r.xacro").write_text(HEAD + '<link name="a"/></robot>')

    def links() -> int:
        xacro_answers._answers.clear()  # as in a new process
        found, _ = expand(tmp_path / "r.xacro", {}, {}, [tmp_path], HERE)
        assert isinstance(found, Expanded)
        return found.text.count("<link")

    assert (links(), links(), started.call_count) == (1, 1, 1)
    [kept] = (tmp_path / "caches").rglob("*.json")
    assert kept.stat().st_mode & 0o777 == 0o600
    kept.write_text("{")
    assert (links(), started.call_count) == (1, 2)
    kept.chmod(0o666)
    assert (links(), started.call_count) == (1, 3)
    (tmp_path / "r.xacro").write_text(HEAD + '<link name="a"/><link name="b"/></robot>')
    assert (links(), started.call_count) == (2, 4)


def test_a_folder_of_caches_that_cannot_be_written_costs_time_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    (tmp_path / "r.xacro").write_text(HEAD + '<link name="a"/></robot>')
    found, _ = expand(tmp_path / "r.xacro", {}, {}, [tmp_path], HERE)
    assert isinstance(found, Expanded)
