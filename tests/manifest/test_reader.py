"""Text becomes a located tree, and every trap of YAML a finding with its place."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.base.findings import Finding, Span
from rbxcompose.manifest.reader import read_file, read_text
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode, at, key_span, value_span
from tests.loops import for_all


def read(text: str) -> MappingNode:
    node, findings = read_text(text, "robot.yaml")
    assert findings == []
    assert isinstance(node, MappingNode)
    return node


def only(text: str | bytes) -> Finding:
    _, findings = read_text(text, "robot.yaml")
    (finding,) = findings
    return finding


def test_every_key_and_value_knows_its_place() -> None:
    tree = read("base:\n  max_speed: 0.5 m/s   # fast\n")
    assert key_span(tree, ("base", "max_speed")) == Span("robot.yaml", 2, 3, 2, 12)
    assert value_span(tree, ("base", "max_speed")) == Span("robot.yaml", 2, 14, 2, 21)


def test_columns_count_characters_not_bytes() -> None:
    assert value_span(read("é: {ü: x}\n"), ("é", "ü")) == Span("robot.yaml", 1, 8, 1, 9)


def test_line_ends_of_windows_and_a_byte_order_mark_change_nothing() -> None:
    node, findings = read_text(b"\xef\xbb\xbfa: 1\r\nb: 2\r\n", "robot.yaml")
    assert findings == []
    assert node == read("a: 1\nb: 2\n")


def test_the_order_of_the_text_is_kept() -> None:
    assert list(read("b: 1\na: 2\nc: 3\n").entries) == ["b", "a", "c"]


def test_an_alias_repeats_what_its_anchor_marks_at_the_anchors_place() -> None:
    tree = read("a: &x {k: 1}\nb: *x\n")
    assert tree.get("a") is tree.get("b")


def test_merge_keys_are_flattened_and_own_keys_win() -> None:
    tree = read("a: &a {k: 1, m: 1}\nb: &b {k: 2, n: 2}\nc:\n  <<: [*a, *b]\n  m: 3\n")
    merged = at(tree, ("c",))
    assert isinstance(merged, MappingNode)
    assert {name: text(entry.value) for name, entry in merged.entries.items()} == {"k": "1", "n": "2", "m": "3"}


def text(node: TreeNode | None) -> str:
    assert isinstance(node, ScalarNode)
    return node.text


def test_remove_and_replace_are_kept_as_tags() -> None:
    tree = read("a: !remove\nb: !replace {k: 1}\n")
    assert [getattr(tree.get(name), "tag", "") for name in "ab"] == ["!remove", "!replace"]


TRAPS = [
    ("a: Note: slow", "RBX1101", (1, 4), "text with a colon and a space needs quotes"),
    ("- say: a: b", "RBX1101", (1, 8), "text with a colon and a space needs quotes"),
    ('a: "Hello" said the robot', "RBX1101", (1, 4), "there is text after the closing quote"),
    ("a: 'it's'", "RBX1101", (1, 4), "there is text after the closing quote"),
    ("a: > 5", "RBX1101", (1, 4), "text that starts with '>' needs quotes"),
    ("a: @home", "RBX1101", (1, 4), "text that starts with '@' needs quotes"),
    ("a: `x`", "RBX1101", (1, 4), "text that starts with '`' needs quotes"),
    ("a: %d", "RBX1101", (1, 4), "text that starts with '%' needs quotes"),
    ("a: &", "RBX1101", (1, 4), "text that starts with '&' needs quotes"),
    ("a: *hello*", "RBX1101", (1, 4), "text that starts with '*' needs quotes"),
    ("a: *hello", "RBX1101", (1, 4), "'*' here means an alias, but nothing has this name"),
    ("a: {check: f($a, $b) < 1}", "RBX1101", (1, 12), "inside {} and [] a comma ends the text"),
    ("a: [f(a, b)]", "RBX1101", (1, 5), "inside {} and [] a comma ends the text"),
    ("a: {b: 1, c}", "RBX1105", (1, 11), "'c' has no value"),
    ("? [a, b]\n: c", "RBX1105", (1, 3), "a key is one word"),
    ('"": c', "RBX1105", (1, 1), "a key is missing before the colon"),
    ("a: Room #3", "RBX1110", (1, 9), "this is a comment, not part of the value"),
    ("colour: #ff0000", "RBX1110", (1, 9), "this is a comment, not part of the value"),
    ("a: 1\nb: 2\na: 3", "RBX1104", (3, 1), "the key 'a' is written twice"),
    ("a:\n\tb: 1", "RBX1106", (2, 1), "there is a tab here"),
    ('a: "\\e[31m"', "RBX1106", (1, 4), "this text contains the invisible character U+001B"),
    ('a: "\\0"', "RBX1106", (1, 4), "this text contains the invisible character U+0000"),
    ("a: b\u202ec", "RBX1106", (1, 5), "a manifest may not contain the character U+202E"),
    ("a: b\x85c", "RBX1106", (1, 5), "a manifest may not contain the character U+0085"),
    ("a: !important", "RBX1107", (1, 4), "manifests have no tag '!important'"),
    ("a: !!python/object:x {}", "RBX1107", (1, 4), "manifests have no tag '!!python/object:x'"),
    ("a: ! 5", "RBX1107", (1, 4), "manifests have no tag '!'"),
    ("a: {b: !remove}", "RBX1102", (1, 8), "a space is missing after '!remove'"),
    ("a: !remove 5", "RBX1107", (1, 4), "'!remove' takes no value"),
    ("a: &a [*a]", "RBX1108", (1, 8), "this alias leads back to what contains it"),
    ("a: 1\nb:\n  <<: 2", "RBX1108", (3, 3), "'<<' takes a map, or a list of maps"),
    ("a: .inf", "RBX1109", (1, 4), "this number is not finite"),
    ("a: 1e999", "RBX1109", (1, 4), "this number is too large"),
    ("a: 1\n---\nb: 2", "RBX1102", (2, 1), "a second document starts here"),
    ("%YAML 1.1\n---\na: 1", "RBX1102", (1, 1), "a manifest has no lines that start with '%'"),
    ("a: [1, 2\nb: 3", "RBX1102", (1, 4), "the closing ']' of this list is missing"),
    ("a: [1\n 2: 3]", "RBX1102", (2, 3), "a ',' or the closing ']' of this list is missing"),
    ("a: {x: 1\nb: 2", "RBX1102", (1, 4), "the closing '}' of this map is missing"),
    ('a: "never closed', "RBX1102", (1, 4), "this quote is never closed"),
    ("a: - b", "RBX1102", (1, 4), "a list cannot start on the line of its key"),
    ("a: 1\nb\nc: 2", "RBX1102", (2, 1), "a colon is missing after this key"),
    ("a:\n  - x\n  y: 1", "RBX1102", (3, 3), "this list item has no dash"),
    ("a:\n  - x\n  -y: 1", "RBX1102", (3, 3), "a space is missing after this dash"),
    ("a:\n  -x\n  -y: 1", "RBX1102", (2, 3), "a space is missing after this dash"),
    ("a:\n  - x:1\n    y: 1", "RBX1102", (2, 5), "a space is missing after this colon"),
    ("a: 1\n  b: 2", "RBX1102", (2, 3), "this key cannot be here"),
    ("a:\n  - b\n c", "RBX1102", (3, 2), "this line does not fit the lines above it"),
    ("{a: 1}}", "RBX1102", (1, 7), "there is extra text here"),
    ("a: ]", "RBX1102", (1, 4), "a value is missing before this ']'"),
    ("a: {b: {", "RBX1102", (2, 1), "a value is missing at the end of the file"),
    ('a: "\\q"', "RBX1102", (1, 5), "a backslash in double quotes starts an escape"),
    ("a: &x 1\nb: &x 2", "RBX1102", (2, 4), "two anchors ('&') have the same name"),
    ("# only a comment", "RBX1102", (1, 1), "this file is empty"),
]


@for_all("source, code, place, words", TRAPS)
def test_a_trap_of_yaml_is_one_finding_at_its_place(source: str, code: str, place: tuple[int, int], words: str) -> None:
    finding = only(source + "\n")
    assert finding.span
    assert (finding.code, (finding.span.line, finding.span.column)) == (code, place)
    assert finding.message.startswith(words)


def test_what_needs_quotes_is_marked_to_its_end() -> None:
    finding = only("a: {check: f($a, $b) < 1}\n")
    assert finding.span == Span("robot.yaml", 1, 12, 1, 25)
    assert finding.label == "put quotes around this"


def test_a_number_with_a_decimal_comma_inside_brackets_is_read_as_it_was_meant() -> None:
    for cut, (column, meant), others in (
        ("a: {b: 0,5 m/s, c: 1}", (8, "0.5 m/s"), {"c": "1"}),
        ("a: {c: 1, b: -1,5}", (14, "-1.5"), {"c": "1"}),
    ):
        node, (finding,) = read_text(f"{cut}\n", "robot.yaml")
        assert isinstance(node, MappingNode)
        assert isinstance(inner := node.get("a"), MappingNode)
        assert {key: value.text for key in inner.entries if isinstance(value := inner.get(key), ScalarNode)} == {
            **others,
            "b": meant,
        }
        assert (finding.code, finding.message) == ("RBX1101", "inside {} a comma ends a number")
        assert (finding.help, finding.span) == (
            f"write '{meant}'",
            Span("robot.yaml", 1, column, 1, column + len(meant)),
        )
    assert only("a: {b: 1, 5 m}\n").help.startswith("inside {} and [] a comma ends a text")


def test_a_comment_with_a_space_is_a_comment() -> None:
    read("a: 45 s   # so short that one patrol needs the dock\nb: {k: 1}  #fine\n")


def test_mistakes_that_do_not_stop_the_reading_are_all_found() -> None:
    _, findings = read_text("a: 1\na: 2\nb: .nan\nc: !x 1\n", "robot.yaml")
    assert [finding.code for finding in findings] == ["RBX1104", "RBX1109", "RBX1107"]


def test_both_places_of_a_key_that_is_written_twice_are_named() -> None:
    assert [str(related.span) for related in only("a: 1\nb: 2\na: 3\n").related] == ["robot.yaml:1:1"]


def test_text_that_is_not_utf8_is_refused_with_the_place_of_the_byte() -> None:
    finding = only(b"a: 1\nb: caf\xe9\n")
    assert (finding.code, finding.label, str(finding.span)) == ("RBX1111", "byte 0xe9", "robot.yaml:2:7")


def test_utf16_is_refused() -> None:
    assert only("a: 1\n".encode("utf-16")).code == "RBX1111"


def test_a_file_that_is_not_there_or_no_file_is_a_finding(tmp_path: Path) -> None:
    for path in (tmp_path / "none.yaml", tmp_path):
        node, (finding,) = read_file(path, "shown", {})
        assert node is None
        assert finding.code == "RBX1301"


def test_a_file_enters_its_text_into_the_sources(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_bytes(b"a: 1\r\n")
    sources: dict[str, str] = {}
    read_file(tmp_path / "a.yaml", "a.yaml", sources)
    assert sources == {"a.yaml": "a: 1\n"}
