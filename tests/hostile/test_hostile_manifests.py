"""Manifests made to do harm end as findings with a place: no crash, no hang, no memory without bounds."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Report
from rbxcompose.commands.formats.json_ import render_json
from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.composition.layers import read_sets
from rbxcompose.compiler.composition.overlay import compose
from rbxcompose.compiler.composition.robot_file import load_robot
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import to_plain
from tests.loops import for_all

ROOT = Path(__file__).parents[2]
TURTLEBOT = (ROOT / "robots/turtlebot/robot.yaml").read_text()


def doubling(levels: int, width: int) -> str:
    lines = ["a0: &a0 [x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * width)}]" for n in range(1, levels)]
    return "\n".join(lines) + "\n"


def merging(levels: int, width: int) -> str:
    lines = ["m0: &m0 {" + ", ".join(f"k{n}: 1" for n in range(width)) + "}"]
    lines += [f"m{n}: &m{n}\n  <<: [{', '.join([f'*m{n - 1}'] * width)}]\n  own{n}: 1" for n in range(1, levels)]
    return "\n".join(lines) + "\n"


def chained(links: int) -> str:
    """Return aliases that lie ever deeper, although no line is deep."""
    return "a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}]\n" for n in range(1, links))


WORST = {
    "20 MB": ("a: " + "x" * 20_000_000, "RBX1103"),
    "500,000 nodes": ("a: [" + "1," * 500_000 + "1]\n", "RBX1103"),
    "180,000 keys": ("".join(f"k{n:06}: 1\n" for n in range(180_000)), "RBX1103"),
    "100,000 brackets": ("a: " + "[" * 100_000, "RBX1103"),
    "100,000 braces": ("a: " + "{a: " * 100_000, "RBX1103"),
    "100,000 dashes": ("- " * 100_000, "RBX1103"),
    "doubling aliases": (doubling(30, 10), "RBX1108"),
    "merging maps": (merging(30, 10), "RBX1108"),
    "one long text": ('about: "' + "x" * 1_900_000 + '"\n', "RBX1103"),
    "one long key": ("k" * 1_900_000 + ": 1\n", "RBX1102"),
    "many anchors": ("".join(f"k{n}: &x{n} 1\n" for n in range(15_000)) + "z: *x0\n", "RBX1001"),
    "many lines": ("\n" * 1_900_000 + "a: [", "RBX1102"),
    "many quotes": ("a: " + '"" ' * 600_000, "RBX1101"),
    "many comments": ("a: 1 #x\n" * 15_000, "RBX1104"),
    "spaces in a quantity": (TURTLEBOT.replace("45 s", '"45' + " " * 60_000 + 'x"'), "RBX1003"),
    "dollars": (TURTLEBOT.replace("45 s", "$" * 60_000), "RBX1003"),
    "braces in text": (TURTLEBOT.replace("45 s", "${" * 30_000), "RBX1201"),
}


HOSTILE = {
    "a zero byte": (b"a: \x00", "RBX1106"),
    "an escaped zero byte": (b'a: "\\0"', "RBX1106"),
    "an escape sequence": (b'a: "\\e[2J"', "RBX1106"),
    "a raw escape": (b"a: \x1b[2J", "RBX1106"),
    "a bidi override": ("a: x\u202ey".encode(), "RBX1106"),
    "an escaped bidi override": (b'a: "\\u202e"', "RBX1106"),
    "an escaped bidi override in a key": (b'"\\u202e": x', "RBX1106"),
    "a line separator": ("a: x\u2028y".encode(), "RBX1106"),
    "a next line": ("a: x\x85y".encode(), "RBX1106"),
    "a delete": (b"a: \x7f", "RBX1106"),
    "a carriage return": (b"a: 1\rb: 2", "RBX1106"),
    "a surrogate": (b'a: "\\ud800"', "RBX1102"),
    "utf-16": ("a: 1".encode("utf-16"), "RBX1111"),
    "latin-1": (b"a: caf\xe9", "RBX1111"),
    "an object": (b"a: !!python/object/apply:os.system [ls]", "RBX1107"),
    "a binary": (b"a: !!binary aGVsbG8=", "RBX1107"),
    "a tag of another kind": (b"a: !<tag:x> b", "RBX1107"),
    "an alias to itself": (b"a: &a [*a]", "RBX1108"),
    "an alias to a map around it": (b"a: &a {b: {c: *a}}", "RBX1108"),
    "a merge of itself": (b"a: &a\n  <<: *a", "RBX1108"),
    "an alias to nothing": (b"a: *b", "RBX1101"),
    "a chain of aliases": (chained(100).encode(), "RBX1108"),
    "65 levels": (b"[" * 65 + b"]" * 65, "RBX1103"),
    "a long number": (b"a: " + b"9" * 5000, "RBX1109"),
    "infinity": (b"a: -.inf", "RBX1109"),
    "not a number": (b"a: .nan", "RBX1109"),
    "a huge exponent": (b"a: 1e400", "RBX1109"),
    "a long key": (b"k" * 300 + b": 1", "RBX1103"),
    "two documents": (b"a: 1\n---\nb: 2", "RBX1102"),
    "a directive": (b"%TAG ! tag:x,2000:\n---\na: 1", "RBX1102"),
    "a key that is a list": (b"? [a]\n: 1", "RBX1105"),
    "nothing": (b"", "RBX1102"),
}


@for_all("text, code", HOSTILE.values())
def test_a_hostile_text_is_a_finding_with_a_place(text: bytes, code: str) -> None:
    _, findings = read_text(text, "robot.yaml")
    assert [finding.code for finding in findings] == [code]
    assert all(finding.span for finding in findings)


def test_64_levels_are_enough_and_allowed() -> None:
    assert read_text("[" * 64 + "]" * 64, "robot.yaml")[1] == []


def test_a_chain_of_aliases_names_both_places() -> None:
    _, (finding,) = read_text("a: &a {b: *a}\n", "robot.yaml")
    assert (str(finding.span), [str(related.span) for related in finding.related]) == (
        "robot.yaml:1:11",
        ["robot.yaml:1:4"],
    )


def test_a_pipe_is_no_manifest(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "robot.yaml")
    report = Report()
    assert load_robot(tmp_path, report=report, sources={}) is None
    assert [finding.code for finding in report] == ["RBX1301"]


def test_all_files_together_have_a_limit(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text("a: 1\n")
    report = Report()
    load_robot(tmp_path / "robot.yaml", report=report, sources={"others": "x" * 8_000_000})
    assert [finding.code for finding in report] == ["RBX1103"]


def load(text: bytes, folder: Path, sets: tuple[str, ...] = ()) -> None:
    """Read a robot and write what is said of it; only its not raising is of interest."""
    path = folder / "robot.yaml"
    path.write_bytes(text)
    report, sources = Report(), dict[str, str]()
    load_robot(path, report=report, sources=sources, profiles=["tired"], sets=sets)
    render_text(report, sources)
    render_json(report, sources)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("mutants")


PIECES = st.one_of(
    st.sampled_from(
        ["", " ", "\n", "  ", ": ", "- ", "[", "]", "{", "}", "&a ", "*a", "!remove", "!replace", "<<: *a"]
    ),
    st.sampled_from(
        ["'", '"', "#", "${args.speed}", "${", "}", "$x", "$$", "%", "@", "|", ">", "\t", "é", "\x00", "\\"]
    ),
    st.sampled_from(["type", "speed", "default", "battery", "dock", "places", "args", "profiles", "missions"]),
    st.sampled_from(["null", "true", "1e9", "-", "0.5 m", "[1, 2]"]),
)
EDITS = st.lists(st.tuples(st.integers(0, len(TURTLEBOT)), st.integers(0, 12), PIECES), min_size=1, max_size=6)


@given(EDITS)
def test_a_mutant_of_a_robot_never_raises(folder: Path, edits: list[tuple[int, int, str]]) -> None:
    text = TURTLEBOT
    for position, length, piece in edits:
        text = text[:position] + piece + text[position + length :]
    load(text.encode(), folder)


@given(st.binary(max_size=300))
def test_random_bytes_never_raise(folder: Path, data: bytes) -> None:
    read_text(data, "robot.yaml")


@given(st.text(alphabet="ab:-[]{}&*!|>'\"#%@` \n\t?,<.\\0", max_size=80))
def test_random_yaml_never_raises(folder: Path, text: str) -> None:
    load(text.encode(), folder)


@given(st.lists(st.text(alphabet="batery.=1 s[]{}:&*!#\n-args", max_size=40), max_size=3).map(tuple))
def test_random_sets_never_raise(folder: Path, sets: tuple[str, ...]) -> None:
    load(TURTLEBOT.encode(), folder, sets)


@given(EDITS)
def test_composing_with_nothing_changes_nothing_even_for_mutants(edits: list[tuple[int, int, str]]) -> None:
    text = TURTLEBOT
    for position, length, piece in edits:
        text = text[:position] + piece + text[position + length :]
    root, _ = read_text(text, "robot.yaml")
    if isinstance(root, MappingNode):
        report = Report()
        once = compose(root, [], report)
        again = compose(once, read_sets([], once, report, {}), report)
        assert to_plain(again) == to_plain(once)
