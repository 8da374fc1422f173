"""The file of pairs of links: it reads back as it was written, and belongs to one body."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.body.link_pairs import REASONS, CollisionMatrix, digest_of, pair_of, read_matrix
from tests.body.kinematics import description_of
from tests.motion.toy_arm import urdf

BODY = description_of(urdf()).body
VISUAL = "<visual><geometry><sphere radius='1'/></geometry></visual>"
NAMES = st.text(st.characters(min_codepoint=32, max_codepoint=0x2FFF, exclude_categories=["C", "Z"]), min_size=1)
PAIRS = st.dictionaries(st.builds(pair_of, NAMES, NAMES), st.sampled_from(REASONS), max_size=5)


@given(PAIRS, st.integers(0, 10**9), st.integers(0, 10**9))
def test_a_file_reads_back_as_it_was_written(pairs: dict[tuple[str, str], str], samples: int, seed: int) -> None:
    matrix = CollisionMatrix(pairs, samples, seed, "0123456789abcdef")  # type: ignore[arg-type]
    assert read_matrix(matrix.text(), "pairs.yaml", BODY, "another") == (matrix, [])


def test_a_line_of_a_file_names_a_pair_and_its_reason() -> None:
    matrix = CollisionMatrix({("fore", "ground"): "user", ("ground", "upper"): "adjacent"}, 10, 1, "12")
    assert matrix.text().partition("pairs:\n")[2] == "- [ground, upper, adjacent]\n- [fore, ground, user]\n"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ('body: "12"\nsamples: 1\nseed: 1\npairs: [[fore, grond, never]]\n', "RBX1008"),
        ('body: "12"\nsamples: 1\nseed: 1\npairs: [[fore, ground, nevr]]\n', "RBX1006"),
        ('body: "12"\nsamples: 1\nseed: 1\n', "RBX1002"),
        ("- a\n", "RBX1003"),
        ("pairs: [\n", "RBX11"),
    ],
)
def test_what_is_wrong_with_a_file_is_told_at_its_line(text: str, code: str) -> None:
    found, findings = read_matrix(text, "pairs.yaml", BODY, "12")
    assert found is None
    assert findings[0].code.startswith(code[:5]), findings
    assert findings[0].span is not None
    assert findings[0].span.file == "pairs.yaml"


def test_only_what_decides_about_collisions_changes_the_digest() -> None:
    whole = digest_of(BODY, {})

    def changed(old: str, new: str) -> str:
        assert old in urdf()
        return digest_of(description_of(urdf().replace(old, new)).body, {})

    assert changed('<link name="turret"/>', f"<!-- a comment --><link name='turret'>{VISUAL}</link>") == whole
    assert changed('xyz="0.1 0 0"', 'xyz="0.10000000001 -0 0"') == whole
    for old, new in (('radius="0.04"', 'radius="0.05"'), ('upper="1.5"', 'upper="1.6"'), ("0.3 0 0", "0.31 0 0")):
        assert changed(old, new) != whole
