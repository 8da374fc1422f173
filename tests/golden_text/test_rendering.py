"""How findings are written for a person, to the letter, and for a program."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rbxcompose.base.findings import Finding, Related, Report, Severity, Span, replacement
from rbxcompose.commands.formats.json_ import render_json
from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.composition.robot_file import load_robot
from rbxcompose.manifest.reader import read_text
from rbxcompose.testing.golden import Golden

ROOT = Path(__file__).parents[2]
MISTAKEN = [
    ("max_speed: 0.5 m/s", "max_speed: fast"),
    ("max_turn_rate: 90 deg/s", "max_turn_rate: 90 deg"),
    ("reach: 20 cm", "reach: 20 cm\n    restrat: on_failure"),
    ("heading: 180 deg", "heading: 180"),
    ("type: charger", "type: chargr"),
    ("speed: ${args.speed}", "speed: ${args.sped}"),
    ("start: patrol", "start: patrol\nstart: patrol"),
]


def span(file: str, line: int, column: int, length: int = 1) -> Span:
    return Span(file, line, column, line, column + length)


def report(*findings: Finding) -> Report:
    return Report(list(findings))


def test_the_mistakes_of_a_robot(golden: Golden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "robots/turtlebot/robot.yaml").read_text()
    for old, new in MISTAKEN:
        text = text.replace(old, new)
    for name, content in (("robots/bot/robot.yaml", text), ("missions/patrol.yaml", "")):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text(content)
    monkeypatch.chdir(tmp_path)
    found, sources = Report(), dict[str, str]()
    load_robot("robots/bot", report=found, sources=sources, profiles=["tird"], sets=["battery.runtime=30 m"])
    golden.check("robot.txt", render_text(found, sources))


def test_the_traps_of_yaml(golden: Golden) -> None:
    traps = [
        "about: Note: slow\n",
        "a: {check: f($a, $b) < 1}\n",
        "a: Room #3\n",
        'say: "Hi" said Ada\n',
        "a: [1, 2\nb: 3\n",
    ]
    texts = []
    for trap in traps:
        _, findings = read_text(trap, "robot.yaml")
        texts.append(render_text(report(*findings), {"robot.yaml": trap}))
    golden.check("traps.txt", "".join(texts))


def test_both_places_of_what_clashes(golden: Golden) -> None:
    related = [Related(span("parts/teleop.yaml", 7, 19), "input 'joystick' (priority: 10)")]
    finding = Finding(
        "RBX3104",
        "two inputs of mux 'cmd_vel' have the same priority 10, so the winner is random",
        span("robot.yaml", 2, 15, 2),
        label="input 'navigation'",
        help="give one of them another priority",
        related=tuple(related),
    )
    golden.check("related.txt", render_text(report(finding), {"robot.yaml": "navigation:\n    priority: 10\n"}))


def test_wide_characters_tabs_and_invisible_ones_keep_the_caret_in_place(golden: Golden) -> None:
    lines = ["a: 漢字 x", "\ta: x", "a\u0301: x", "a: \x1b[31m x"]
    sources = {"f": "\n".join(lines)}
    findings = [Finding("RBX1003", "here", span("f", n, len(line))) for n, line in enumerate(lines, 1)]
    golden.check("wide.txt", render_text(report(*findings), sources))


def test_of_a_long_line_only_the_surroundings_are_shown(golden: Golden) -> None:
    source = "x" * 500 + "HERE" + "y" * 500
    golden.check("long_line.txt", render_text(report(Finding("RBX1003", "here", span("f", 1, 501, 4))), {"f": source}))


def test_at_most_twenty_are_shown_and_the_rest_counted() -> None:
    findings = [
        Finding("RBX1001", f"number {n}", severity=Severity.WARNING if n < 5 else Severity.ERROR) for n in range(25)
    ]
    lines = render_text(report(*findings), {}).splitlines()
    assert len(lines) == 22
    assert lines[-2:] == ["... and 5 more", "20 errors, 5 warnings"]


def test_one_is_singular_and_none_is_nothing() -> None:
    assert render_text(report(Finding("RBX1001", "x")), {}).endswith("1 error\n")
    assert render_text(report(), {}) == ""


def test_colour_is_added_only_if_asked_for() -> None:
    found = report(Finding("RBX1001", "x", span("f", 1, 1)))
    assert "\x1b" not in render_text(found, {"f": "x"})
    assert "\x1b[1;31merror[RBX1001]\x1b[0m" in render_text(found, {"f": "x"}, colour=True)


def test_a_place_outside_of_its_source_does_no_harm() -> None:
    for place in (span("none", 1, 1), span("f", 99, 1), span("f", 1, 99), Span("f", 1, 1, 9, 1)):
        assert "here" in render_text(report(Finding("RBX1001", "here", place, label="label")), {"f": "x"})


def test_nothing_from_a_manifest_reaches_the_terminal_raw() -> None:
    nasty = "\x1b]0;title\x07\u202e"
    found = report(Finding("RBX1001", nasty, span(nasty, 1, 1), nasty, nasty, (Related(span(nasty, 1, 1), nasty),)))
    text = render_text(found, {nasty: nasty})
    assert not set("\x1b\x07\u202e") & set(text)


def test_json_holds_everything() -> None:
    related = (Related(span("g", 2, 3), "the first"),)
    fix = replacement(span("f", 1, 2, 3), "two", "one")
    found = report(Finding("RBX1104", "twice", span("f", 1, 2, 3), "the second", "remove one", related, fix=fix))
    assert json.loads(render_json(found, {"f": " two"})) == [
        {
            "code": "RBX1104",
            "severity": "error",
            "message": "twice",
            "file": "f",
            "line": 1,
            "column": 2,
            "end_line": 1,
            "end_column": 5,
            "label": "the second",
            "help": "remove one",
            "related": [{"file": "g", "line": 2, "column": 3, "end_line": 2, "end_column": 4, "message": "the first"}],
            "fix": {
                "title": "'two' -> 'one'",
                "is_safe": True,
                "edits": [
                    {"file": "f", "line": 1, "column": 2, "end_line": 1, "end_column": 5, "old": "two", "text": "one"}
                ],
            },
        }
    ]
    assert json.loads(render_json(report(Finding("RBX1301", "x")), {}))[0]["file"] is None


def test_a_fix_that_does_not_fit_the_text_is_not_told() -> None:
    found = report(Finding("RBX1104", "x", span("f", 1, 1, 3), fix=replacement(span("f", 1, 1, 3), "two", "one")))
    assert json.loads(render_json(found, {"f": "tow"}))[0]["fix"] is None
    assert render_text(found, {"f": "tow"}).endswith("1 error\n")
    assert render_text(found, {"f": "two"}).endswith("1 error; it can be fixed with 'check --fix'\n")


def test_several_further_places_stand_in_one_column_once_each(golden: Golden) -> None:
    chain = [Related(span("robots/tug/robot.yaml", 12, 5), "included by this")]
    places = [Related(span("parts/b.yaml", 3, 5), "the first"), *chain, *chain]
    finding = Finding("RBX1104", "the key 'a' is written twice", span("f", 1, 1), related=tuple(places))
    golden.check("places.txt", render_text(report(finding), {"f": "a: 1"}))


def test_of_many_further_places_the_rest_is_counted() -> None:
    places = tuple(Related(span("f", n, 1), "here") for n in range(1, 30))
    assert "::: and 21 more places" in render_text(report(Finding("RBX1104", "x", span("f", 1, 1), related=places)), {})
