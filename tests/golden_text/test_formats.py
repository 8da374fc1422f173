"""What programs read: SARIF and the workflow commands of GitHub; and that each format is found by its file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.findings import (
    KINDS,
    Edit,
    Finding,
    FindingKind,
    Fix,
    Related,
    Report,
    Severity,
    Span,
    replacement,
)
from rbxcompose.commands.formats import PLUGINS, format_names, renderer

KIND = FindingKind("RBX0001", Severity.WARNING, doc="A title of {braces}.\n\nThe first part.\n\nBad: this\n")
SOURCES = {"robots/a b/robot.yaml": 'name: "on"\n', "--set": "a.b=1"}
FILE = "robots/a b/robot.yaml"


@pytest.fixture(autouse=True)
def known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(KINDS, KIND.code, KIND)


def span(file: str, line: int, column: int, length: int = 1) -> Span:
    return Span(file, line, column, line, column + length)


FINDINGS = [
    KIND.at(
        span(FILE, 1, 7, 4),
        "100 % wrong: a, b {0}",
        label="this\nhere",
        help="do: that",
        related=[Related(span("g.yaml", 2, 3), "the first"), Related(span("g.yaml", 2, 3), "the first")],
        fix=replacement(span(FILE, 1, 7, 4), "on", "off"),
    ),
    Finding("RBX0002", "on the command line", span("--set", 1, 1, 3)),
    Finding("RBX0003", "without a place"),
    Finding("RBX0004", "over two lines", Span("/absolute/f.yaml", 3, 2, 4, 5)),
]


def sarif(*findings: Finding, sources: dict[str, str] = SOURCES) -> Any:
    log = json.loads(renderer("sarif")(Report(list(findings)), sources, False))
    assert log["version"] == "2.1.0"
    [run] = log["runs"]
    return run


def result(finding: Finding) -> Any:
    [found] = sarif(finding)["results"]
    return found


def test_every_file_is_a_format() -> None:
    assert set(format_names()) == {"text", "json", "sarif", "github"}
    assert {name.removesuffix("_") for name in PLUGINS.shipped} == set(format_names())
    assert all(isinstance(renderer(name)(Report(), {}, False), str) for name in format_names())


def test_an_unknown_format_is_an_error_of_ours() -> None:
    with pytest.raises(KeyError):
        renderer("xml")


def test_sarif_has_what_the_specification_demands() -> None:
    run = sarif(*FINDINGS)
    driver = run["tool"]["driver"]
    assert driver["name"] == "rbxcompose"
    assert run["columnKind"] == "unicodeCodePoints"
    assert [rule["id"] for rule in driver["rules"]] == ["RBX0001", "RBX0002", "RBX0003", "RBX0004"]
    for entry in run["results"]:
        assert driver["rules"][entry["ruleIndex"]]["id"] == entry["ruleId"]
        assert entry["level"] in ("error", "warning", "note", "none")
        assert entry["message"]["text"]
        for place in [*entry["locations"], *entry.get("relatedLocations", [])]:
            region = place["physicalLocation"].get("region", {})
            assert place["physicalLocation"]["artifactLocation"]["uri"]
            assert all(isinstance(number, int) and number >= 1 for number in region.values())


def test_a_rule_of_sarif_brings_the_page_of_its_code() -> None:
    [rule] = sarif(FINDINGS[0])["tool"]["driver"]["rules"]
    assert rule["shortDescription"]["text"] == "A title of {{braces}}."
    assert rule["fullDescription"]["text"] == "The first part."
    assert "Bad: this" in rule["help"]["text"]
    assert rule["help"]["markdown"].startswith("# A title of {braces}.")
    assert rule["defaultConfiguration"]["level"] == "warning"


def test_a_place_of_sarif_is_a_path_below_the_root_with_lines_and_columns_from_1() -> None:
    [place] = result(FINDINGS[0])["locations"]
    assert place["physicalLocation"] == {
        "artifactLocation": {"uri": "robots/a%20b/robot.yaml", "uriBaseId": "%SRCROOT%"},
        "region": {"startLine": 1, "startColumn": 7, "endLine": 1, "endColumn": 11},
    }
    [outside] = result(FINDINGS[3])["locations"]
    assert outside["physicalLocation"]["artifactLocation"] == {"uri": "file:///absolute/f.yaml"}


def test_what_is_about_no_file_stands_at_the_robot_that_was_checked() -> None:
    for finding in FINDINGS[1:3]:
        [place] = result(finding)["locations"]
        assert place == {
            "physicalLocation": {"artifactLocation": {"uri": "robots/a%20b/robot.yaml", "uriBaseId": "%SRCROOT%"}}
        }
    assert "at --set:1:1" in result(FINDINGS[1])["message"]["text"]
    [found] = sarif(FINDINGS[2], sources={})["results"]
    assert found["locations"] == []


def test_words_of_sarif_are_no_placeholders() -> None:
    assert result(FINDINGS[0])["message"]["text"] == "100 % wrong: a, b {{0}}\nthis\nhere\nhelp: do: that"


def test_a_second_place_stands_once_and_has_a_number() -> None:
    [related] = result(FINDINGS[0])["relatedLocations"]
    assert related["id"] == 1
    assert related["message"]["text"] == "the first"
    assert related["physicalLocation"]["region"]["startLine"] == 2


def test_a_fix_of_sarif_replaces_what_stands_within_quotes() -> None:
    [fix] = result(FINDINGS[0])["fixes"]
    [change] = fix["artifactChanges"]
    [replaced] = change["replacements"]
    assert fix["description"]["text"] == "'on' -> 'off'"
    assert replaced["deletedRegion"] == {"startLine": 1, "startColumn": 8, "endLine": 1, "endColumn": 10}
    assert replaced["insertedContent"] == {"text": "off"}


def test_an_edit_that_only_guards_is_no_replacement() -> None:
    guard, edit = Edit(span(FILE, 1, 1, 4), "name", "name"), Edit(span(FILE, 1, 5), ":", "::")
    [fix] = result(Finding("RBX0001", "x", span(FILE, 1, 1), fix=Fix((guard, edit), True, "t")))["fixes"]
    assert len(fix["artifactChanges"][0]["replacements"]) == 1


def test_the_commands_of_github_are_escaped() -> None:
    assert renderer("github")(Report(FINDINGS), SOURCES, False).splitlines() == [
        "::error title=RBX0003::without a place",
        "::error title=RBX0002::--set:1:1: on the command line",
        "::error file=/absolute/f.yaml,line=3,endLine=4,title=RBX0004::over two lines",
        "::warning file=robots/a b/robot.yaml,line=1,col=7,endColumn=11,title=RBX0001::"
        "100 %25 wrong: a, b {0}%0Athis%0Ahere%0Ag.yaml:2:3: the first%0Ahelp: do: that",
    ]


def test_a_name_cannot_break_out_of_a_command_of_github() -> None:
    nasty = Finding("RBX0001", "x\r\n::error::y", span("a,b:c\n::warning::%", 1, 1))
    [line] = renderer("github")(Report([nasty]), {}, False).splitlines()
    assert line.startswith("::error file=a%2Cb%3Ac\\n%3A%3Awarning%3A%3A%25,line=1")
    assert line.endswith("x%0D%0A::error::y")


def test_rendering_reads_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in format_names():
        assert renderer(name)(Report(FINDINGS), {}, False)
